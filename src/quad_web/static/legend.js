/**
 * The legend of the arena, with a sample of each thing that is shown.
 */

import { costColour, INK, mix } from "./colours.js";
import { make } from "./dom.js";
import { levelOf, yieldColour } from "./fleet.js";
import {
  drawArrow,
  drawContacts,
  drawCross,
  drawGoal,
  drawLocalizations,
  drawTracks,
  GOAL_SIZES,
} from "./map_marks.js";
import { drawPaths, drawScans } from "./map_paths.js";
import { drawRobot, troubleOf } from "./map_robots.js";
import { drawObstacles, drawSolids } from "./map_scene.js";
import { Viewport } from "./viewport.js";

const WIDTH = 40;
const HEIGHT = 22;
const COLOUR = "#2078dc";
const ALTITUDE_M = 1;

/** Samples are drawn as in the arena, with one metre for each pixel. */
function viewport() {
  return Object.assign(new Viewport(), { width: WIDTH, height: HEIGHT, scale: 1 });
}

const toScreen = (x, y) => viewport().toScreen(x, y);

function robot(context) {
  const pose = { x: 0, y: 0, roll: 0, pitch: 0.12, yaw: 0 };
  drawRobot(context, viewport(), { ...pose, radius: 11, colour: COLOUR, state: "" }, false);
}

function troubled(context) {
  const pose = { x: 0, y: 0, roll: 0, pitch: 0, yaw: 0, radius: 7, colour: COLOUR };
  drawRobot(context, viewport(), { ...pose, x: -8, state: "recovering" }, false);
  drawRobot(context, viewport(), { ...pose, x: 8, state: "lost" }, false);
}

const SAMPLE_GOAL = { x: 0, y: 0, index: 0, colour: COLOUR };

const goal = (state, yaw) => (context) => {
  const shown = { ...SAMPLE_GOAL, x: yaw === null ? 0 : -7, yaw, state };
  drawGoal(context, toScreen, shown, GOAL_SIZES[1], false);
};

function path(kind) {
  return (context) => {
    const points = Float32Array.from([-14, -6, -5, 4, 5, 1, 14, 5]);
    const paths = { trails: [], plans: [], localPlans: [], selected: null };
    paths[kind] = [{ points, width: 2, colour: COLOUR }];
    drawPaths(context, viewport(), paths);
  };
}

function scan(context) {
  const points = [-12, -7, -2, 3, 8, 12].flatMap((x, i) => [x, i % 2 ? 1 : -1]);
  const scans = [{ points: Float32Array.from(points), width: 2, colour: COLOUR }];
  drawScans(context, viewport(), scans);
}

const BOX = [
  [12, 7],
  [-12, 7],
  [-12, -7],
  [12, -7],
];
const DISC = Array.from({ length: 32 }, (_, i) => {
  const angle = (Math.PI * i) / 16;
  return [9 * Math.cos(angle), 9 * Math.sin(angle)];
});

function solid(bottom, height, crosses) {
  return (context) => {
    const box = { outline: BOX, x: 0, y: 0, yaw: 0, bottom, height, crosses };
    drawSolids(context, viewport(), { altitude_m: ALTITUDE_M, solids: [box], walls: [] });
  };
}

function moving(shape) {
  return (context) => {
    const place = { x: 0, y: 0, yaw: 0, bottom: 0, height: 2, crosses: true };
    drawObstacles(context, viewport(), [{ ...place, ...shape }], ALTITUDE_M);
  };
}

function track(kind) {
  return (context) => {
    const motion = kind === "suspect" ? { x: 0, vx: 0 } : { x: -6, vx: 20 };
    drawTracks(context, toScreen, [{ y: 0, vy: 0, radius: 8, colour: COLOUR, kind, ...motion }]);
  };
}

function localization(context) {
  const points = [-12, 4, -9, -5, -4, 6, -1, -7, 3, 5, 6, -4];
  const pose = { x: -6, y: 0, yaw: 0, variances: [16, 0, 6, 0.01] };
  drawLocalizations(context, toScreen, [{ ...pose, points, colour: COLOUR, isLost: false }]);
}

function costs(first, last) {
  return (context) => {
    for (let i = 0; i < WIDTH; i += 1) {
      const cost = Math.round(first + ((last - first) * i) / (WIDTH - 1));
      const [red, green, blue] = costColour(cost);
      context.fillStyle = `rgba(${red},${green},${blue},0.75)`;
      context.fillRect(i, 5, 1, HEIGHT - 10);
    }
  };
}

function arrow(kind) {
  return (context) => {
    context.setLineDash(kind === "limited" ? [2, 4] : [7, 4]);
    drawArrow(context, [3, HEIGHT / 2], [WIDTH - 3, HEIGHT / 2], yieldColour(kind));
    context.setLineDash([]);
  };
}

function cell(context) {
  context.setLineDash([5, 4]);
  context.strokeStyle = mix(COLOUR, INK.plate, 0.3);
  context.strokeRect(4, 4, WIDTH - 8, HEIGHT - 8);
}

const contact = (context) =>
  drawContacts(context, toScreen, [{ x: 0, y: 0, time_s: 0, isFresh: false }]);
const hold = (context) => drawCross(context, WIDTH / 2, HEIGHT / 2, 6, INK.makesRoom, 3);

const isGoal = (state) => (fleet) => fleet.goals.some((one) => one.state === state);
const isTrack = (kind) => (fleet) => fleet.tracks.some((one) => one.kind === kind);
const isYield = (kind) => (fleet) => fleet.yields.some((one) => one.kind === kind);
const has = (part) => (fleet) => fleet[part].length > 0;
const isSolid = (level) => ({ isMap, scene, altitude }) =>
  isMap && Boolean(scene?.solids.some((one) => levelOf(one, altitude) === level));

/** What it is, a function that draws a sample, and one that finds it in a fleet. */
const ENTRIES = [
  ["Quadcopter: white nose ahead, dot leans with it", robot, has("robots")],
  ["Recovering; lost or stopped", troubled, (fleet) => fleet.robots.some(troubleOf)],
  ["Active goal with its yaw", goal("active", 0), isGoal("active")],
  ["Goal to come", goal("pending", null), isGoal("pending")],
  ["Goal reached", goal("reached", null), isGoal("reached")],
  ["Goal failed", goal("failed", null), isGoal("failed")],
  ["Trail", path("trails"), has("trails")],
  ["Global plan", path("plans"), has("plans")],
  ["Local plan", path("localPlans"), has("localPlans")],
  ["LIDAR points", scan, has("scans")],
  ["Voronoi cell", cell, has("cells")],
  ["Believed pose; 95 % region; particles", localization, has("localizations")],
  ["Tracked obstacle; the line ends where it is in 1 s", track("seen"), isTrack("seen")],
  ["Tracked, but hidden: predicted", track("hidden"), isTrack("hidden")],
  ["Suspect: may move", track("suspect"), isTrack("suspect")],
  ["Waits for the other", arrow("waits"), isYield("waits")],
  ["Makes room for the other", arrow("makes room"), isYield("makes room")],
  ["Place where it will hold", hold, (fleet) => fleet.yields.some((one) => one.hold)],
  ["Limited by the other", arrow("limited"), isYield("limited")],
  ["Contact", contact, has("contacts")],
  ["Cost: low to high", costs(1, 98), has("costmaps")],
  ["Inscribed: the centre collides", costs(99, 99), has("costmaps")],
  ["Lethal: an obstacle", costs(100, 100), has("costmaps")],
  ["Unknown", costs(-1, -1), has("costmaps")],
  [
    "Moving obstacle",
    moving({ outline: BOX }),
    (fleet) => fleet.obstacles.some((one) => !one.person),
  ],
  [
    "Person: the tip is ahead",
    moving({ outline: DISC, reach: 9, hasHeading: true }),
    (fleet) => fleet.obstacles.some((one) => one.person),
  ],
  ["Obstacle at the flying altitude", solid(0, 2, true), isSolid("across")],
  ["Obstacle below it", solid(0, 0.5, false), isSolid("low")],
  ["Obstacle above it", solid(1.5, 0.5, false), isSolid("high")],
];

/** A panel with what is, or was, in the arena since it was opened. */
export class Legend {
  constructor() {
    const name = { role: "region", "aria-label": "Legend", tabindex: 0 };
    this.element = make("div", { class: "quad-legend", ...name, hidden: true });
    this._entries = new Set();
  }

  /** Open or close it; return whether it is open. */
  toggle() {
    this.element.hidden = !this.element.hidden;
    this.clear();
    return !this.element.hidden;
  }

  /** Begin anew, as with other layers or colours. */
  clear() {
    this._entries.clear();
    this.element.replaceChildren();
  }

  /** Add what is new in a fleet; `isMap` in the map view. */
  update(fleet, isMap) {
    if (this.element.hidden) {
      return;
    }
    const place = { ...fleet, isMap };
    const found = ENTRIES.filter((entry) => !this._entries.has(entry) && entry[2](place));
    if (found.length) {
      found.forEach((entry) => this._entries.add(entry));
      this.element.replaceChildren(
        ...ENTRIES.filter((entry) => this._entries.has(entry)).map(([text, draw]) =>
          make("div", { class: "quad-legend-entry" }, sample(draw), text),
        ),
      );
    }
  }
}

function sample(draw) {
  const ratio = window.devicePixelRatio || 1;
  const style = `width:${WIDTH}px;height:${HEIGHT}px`;
  const size = { width: Math.round(WIDTH * ratio), height: Math.round(HEIGHT * ratio) };
  const canvas = make("canvas", { ...size, "aria-hidden": "true" });
  canvas.style.cssText = style;
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  draw(context);
  return canvas;
}
