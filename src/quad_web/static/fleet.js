/**
 * What both views draw: one plain object for each thing, made from the items of the store.
 */

import { INK, mix, seen } from "./colours.js";

/** Layers that the server sends on request, as in `view/state.py`. */
export const STREAMED_LAYERS = [
  "trail",
  "plan",
  "local_plan",
  "scan",
  "global_costmap",
  "local_costmap",
  "cell",
  "track",
  "localization",
];

/** In larger fleets LIDAR points, local plans and tracks are those of the selected robot. */
export const LARGE_FLEET = 20;

/** Those of them that are shown of the selected robot only. */
export const OF_ONE_ROBOT = ["global_costmap", "local_costmap"];

/** Return the colour of a kind of yields. */
export function yieldColour(kind) {
  return { waits: INK.waits, "makes room": INK.makesRoom }[kind] ?? INK.limited;
}

/** Seconds that a contact stays marked with its time; afterwards its cross is faint. */
const CONTACT_FRESH_S = 20;
const MOST_CONTACTS = 200;
const POSE_LENGTH = 9;
const TRACK_LENGTH = 6;
const TRACK_KINDS = ["seen", "hidden", "suspect"]; // as in `view/state.py`
const DEFAULT_RADIUS_M = 0.3;

/**
 * What the person has chosen in this page.
 *
 * @typedef {object} Choices
 * @property {?number} selected Number of the selected robot.
 * @property {Set<string>} layers Layers that are shown.
 * @property {?{robot: number, goals: object[], faults: string[]}} editing Goals being edited.
 */

/** Return what is there to draw: a store and choices as one plain object. */
export function fleetOf(store, choices) {
  const scene = store.get("scene")?.data ?? null;
  const looks = store.get("robots")?.data ?? { colours: [], names: [], radius_m: DEFAULT_RADIUS_M };
  const colourOf = (robot) => seen(looks.colours[robot] ?? INK.limited);
  const robots = robotsOf(store, looks, colourOf);
  const shown = (layer) => choices.layers.has(layer);
  const polylines = (kind) =>
    shown(kind)
      ? store.all(kind).map(({ robot, arrays }) => ({
          robot,
          colour: colourOf(robot),
          points: arrays.points.values,
          width: arrays.points.shape[1],
        }))
      : [];
  return {
    scene,
    sceneRevision: store.get("scene")?.revision ?? 0,
    obstacles: obstaclesOf(store, scene),
    altitude: scene?.altitude_m ?? 1,
    selected: robots.get(choices.selected) ?? null,
    robots: [...robots.values()],
    trails: polylines("trail"),
    plans: polylines("plan"),
    localPlans: polylines("local_plan"),
    cells: polylines("cell"),
    scans: polylines("scan"),
    localizations: shown("localization") ? localizationsOf(store, colourOf) : [],
    tracks: shown("track") ? tracksOf(store, colourOf, choices) : [],
    costmaps: OF_ONE_ROBOT.filter(shown).flatMap((kind) => store.all(kind)),
    goals: shown("goals") ? goalsOf(store, colourOf, choices) : [],
    yields: shown("yields") ? yieldsOf(store, robots) : [],
    contacts: shown("contacts") ? contactsOf(store) : [],
    editing: choices.editing && { ...choices.editing, colour: colourOf(choices.editing.robot) },
  };
}

/** Robots by number; those without a pose are left out. */
function robotsOf(store, looks, colourOf) {
  const pose = store.get("poses")?.arrays.pose;
  const rows = new Map((store.get("status")?.data.rows ?? []).map((row) => [row.robot, row]));
  const robots = new Map();
  const count = pose ? pose.shape[0] : 0;
  for (let index = 0; index < count; index += 1) {
    const [x, y, z, roll, pitch, yaw] = pose.values.subarray(
      index * POSE_LENGTH,
      (index + 1) * POSE_LENGTH,
    );
    if (Number.isFinite(x) && Number.isFinite(y)) {
      robots.set(index, {
        index,
        name: looks.names[index] ?? String(index),
        colour: colourOf(index),
        radius: looks.radius_m || DEFAULT_RADIUS_M,
        state: rows.get(index)?.state ?? "",
        ...{ x, y, z, roll, pitch, yaw },
      });
    }
  }
  return robots;
}

/** Solids that move, where they are; those of which it is unknown are left out. */
function obstaclesOf(store, scene) {
  const poses = store.get("obstacles")?.arrays.poses;
  const placed = (scene?.moving ?? []).map((solid, index) => {
    const [x, y, yaw] = poses ? poses.values.subarray(3 * index, 3 * index + 3) : [];
    const hasHeading = Boolean(solid.person) && Number.isFinite(yaw);
    return { ...solid, index, x, y, yaw: Number.isFinite(yaw) ? yaw : 0, hasHeading };
  });
  return placed.filter(({ x, y }) => Number.isFinite(x) && Number.isFinite(y));
}

/** Tracks and suspects, discs with velocities: of the selected robot, or of all without one. */
function tracksOf(store, colourOf, { selected }) {
  const isShown = ({ robot }) => selected === null || robot === selected;
  return store.all("track").filter(isShown).flatMap(({ robot, arrays: { rows } }) =>
    Array.from({ length: rows.shape[0] }, (_, index) => {
      const first = index * TRACK_LENGTH;
      const [x, y, vx, vy, radius, kind] = rows.values.subarray(first, first + TRACK_LENGTH);
      return { robot, colour: colourOf(robot), x, y, vx, vy, radius, kind: TRACK_KINDS[kind] };
    }),
  );
}

/** Where robots believe themselves; `variances` are xx, xy, yy and that of the yaw. */
function localizationsOf(store, colourOf) {
  return store.all("localization").map(({ robot, data, arrays: { pose, points } }) => {
    const [x, y, yaw, ...variances] = pose.values;
    const colour = data.is_lost ? INK.fault : mix(colourOf(robot), INK.strong, 0.45);
    return { robot, colour, x, y, yaw, variances, points: points.values, isLost: data.is_lost };
  });
}

function goalsOf(store, colourOf, { editing, selected }) {
  const goals = store.get("goals")?.data.goals ?? [];
  return goals
    .filter((goal) => goal.robot !== editing?.robot)
    .map((goal) => ({
      ...goal,
      colour: colourOf(goal.robot),
      isOfSelected: goal.robot === selected,
    }));
}

function yieldsOf(store, robots) {
  return (store.get("yields")?.data.yields ?? [])
    .map(({ robot, peer, kind, hold }) => ({
      robot: robots.get(robot),
      peer: robots.get(peer) ?? null,
      kind,
      hold,
      colour: yieldColour(kind),
    }))
    .filter(({ robot }) => robot);
}

function contactsOf(store) {
  const contacts = store.get("contacts")?.data.contacts ?? [];
  const now_s = store.get("flight")?.data.time_s ?? 0;
  return contacts.slice(-MOST_CONTACTS).map((contact) => ({
    ...contact,
    isFresh: now_s - contact.time_s < CONTACT_FRESH_S,
  }));
}

/**
 * Return the horizontal part of a robot's upward axis: where its thrust pulls it to.
 *
 * @returns {[number, number]} x and y in `map`, the length is the sine of the tilt.
 */
export function tiltOf({ roll, pitch, yaw }) {
  const ahead = Math.sin(pitch) * Math.cos(roll);
  const left = -Math.sin(roll);
  return [
    Math.cos(yaw) * ahead - Math.sin(yaw) * left,
    Math.sin(yaw) * ahead + Math.cos(yaw) * left,
  ];
}

/** Return the smallest rectangle around the arena, or around the robots without one. */
export function boundsOf({ scene, robots }) {
  if (scene) {
    const [minX, minY] = scene.origin_m;
    return { minX, minY, maxX: minX + scene.size_m[0], maxY: minY + scene.size_m[1] };
  }
  const xs = robots.map((robot) => robot.x);
  const ys = robots.map((robot) => robot.y);
  return {
    minX: Math.min(-1, ...xs),
    minY: Math.min(-1, ...ys),
    maxX: Math.max(1, ...xs),
    maxY: Math.max(1, ...ys),
  };
}

/** Return "low", "high" or "across" (at the flying altitude) for an obstacle. */
export function levelOf(solid, altitude) {
  if (solid.crosses) {
    return "across";
  }
  return solid.bottom >= altitude ? "high" : "low";
}

/** Return the corners [x, y] of a solid's outline in `map`. */
export function outlineOf({ outline, x, y, yaw }) {
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  return outline.map(([u, v]) => [x + cos * u - sin * v, y + sin * u + cos * v]);
}

/** Return the obstacle or wall that covers a point, null if there is none. */
export function solidAt({ scene, obstacles }, x, y) {
  const solids = [...(obstacles ?? []), ...(scene?.solids ?? []), ...(scene?.walls ?? [])];
  const isNear = (solid) => Math.hypot(x - solid.x, y - solid.y) <= solid.reach;
  return solids.find((solid) => isNear(solid) && covers(outlineOf(solid), x, y)) ?? null;
}

/** Return whether a polygon covers a point: a ray from there along x crosses an odd side. */
function covers(corners, x, y) {
  const crossed = corners.filter(([ax, ay], i) => {
    const [bx, by] = corners.at(i - 1);
    return ay > y !== by > y && x < ax + ((bx - ax) * (y - ay)) / (by - ay);
  });
  return crossed.length % 2 === 1;
}
