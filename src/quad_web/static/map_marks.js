/**
 * Marks at places in the arena: goals, tracks, yields and contacts. Both views draw them with a
 * function that gives the pixels of a place.
 *
 * @typedef {(x: number, y: number) => [number, number]} ToScreen
 */

import { INK, mix, textOn, withAlpha } from "./colours.js";
import { tracePath } from "./viewport.js";

export const FONT = "Roboto, system-ui, sans-serif";

const FEW_GOALS = 12;

const TRACK_CORNERS = 32;
const CHI_SQUARED = 5.99; // two degrees of freedom, 95 %
const AHEAD_S = 1; // after which a tracked obstacle is at the end of its line
const SLOWEST_MPS = 0.05; // slower ones have no line

/** Fill, opacity of the ring, and dashes, by kind. */
const TRACK_LOOKS = {
  seen: { fill: withAlpha(INK.tracked, 0.3), ring: 1, dash: [] },
  hidden: { fill: withAlpha(INK.tracked, 0.12), ring: 0.6, dash: [5, 4] },
  suspect: { fill: withAlpha(INK.suspect, 0.35), ring: 0.7, dash: [1.5, 3] },
};

/** Radius of goals and size of their numbers (0: none), for so many pixels between goals. */
export const GOAL_SIZES = [
  { from: 110, radius: 9, font: 11 },
  { from: 60, radius: 7, font: 9 },
  { from: 0, radius: 4, font: 0 },
];

/** Draw goals; if a robot is selected, those of the others are faint. */
export function drawGoals(context, toScreen, goals, hasSelection) {
  drawOrder(context, toScreen, goals.filter((goal) => goal.isOfSelected));
  const size = sizeFor(goals.map(({ x, y }) => toScreen(x, y)));
  const rank = (goal) => (goal.isOfSelected ? 2 : 0) + (goal.state === "active" ? 1 : 0);
  for (const goal of [...goals].sort((a, b) => rank(a) - rank(b))) {
    const isFaint = hasSelection && !goal.isOfSelected;
    drawGoal(context, toScreen, goal, goal.isOfSelected ? GOAL_SIZES[0] : size, isFaint);
  }
}

/** Return the size for goals at some places, which is smaller where they are close together. */
function sizeFor(places) {
  const side = (values) => Math.max(...values) - Math.min(...values);
  const area = side(places.map(([px]) => px)) * side(places.map(([, py]) => py));
  const least = places.length > FEW_GOALS ? 0 : GOAL_SIZES[1].from; // few ones have numbers
  const spacing = Math.max(Math.sqrt(area / places.length), least);
  return GOAL_SIZES.find(({ from }) => spacing >= from);
}

/** A dotted line through the goals of one robot. */
function drawOrder(context, toScreen, goals) {
  if (goals.length < 2) {
    return;
  }
  const places = goals.map(({ x, y }) => toScreen(x, y));
  drawDashes(context, places, [2, 5], withAlpha(goals[0].colour, 0.8), 1.5);
}

/** Draw a dashed line through places in pixels. */
export function drawDashes(context, places, dash, colour, width) {
  tracePath(context, places);
  context.setLineDash(dash);
  context.lineWidth = width;
  context.strokeStyle = colour;
  context.stroke();
  context.setLineDash([]);
}

/** Draw one goal, a numbered disc with an arrow for the yaw; `size` is one of `GOAL_SIZES`. */
export function drawGoal(context, toScreen, goal, size, isFaint) {
  const [px, py] = toScreen(goal.x, goal.y);
  const isActive = goal.state === "active";
  const radius = size.radius + (isActive && size.font ? 2 : 0);
  context.globalAlpha = (goal.state === "reached" ? 0.4 : 1) * (isFaint ? 0.55 : 1);
  if (goal.yaw !== null && size.font) {
    const tip = ahead(toScreen, goal, radius + 14);
    drawArrow(context, [px, py], tip, goal.colour, 2.5);
  }
  const edge = size.font ? 2 : 1.5;
  disc(context, px, py, radius, isActive ? goal.colour : INK.plate, goal.colour, edge);
  if (isActive) {
    disc(context, px, py, radius + 3, "transparent", goal.colour, 1.5);
  }
  if (size.font) {
    const ink = isActive ? textOn(goal.colour) : mix(goal.colour, INK.strong, 0.35);
    write(context, String(goal.index + 1), px, py, size.font + (isActive ? 1 : 0), ink);
  }
  if (goal.state === "failed") {
    drawCross(context, px, py, 0.75 * radius, INK.fault);
  }
  context.globalAlpha = 1;
}

/** Return the place that is so many pixels ahead of a goal; any yaw is east. */
export function ahead(toScreen, { x, y, yaw }, distance) {
  const [px, py] = toScreen(x, y);
  const [qx, qy] = toScreen(x + 0.1 * Math.cos(yaw ?? 0), y + 0.1 * Math.sin(yaw ?? 0));
  const share = distance / (Math.hypot(qx - px, qy - py) || 1);
  return [px + share * (qx - px), py + share * (qy - py)];
}

/** Draw an arrow between two places in pixels. */
export function drawArrow(context, [ax, ay], [bx, by], colour, width = 2) {
  const angle = Math.atan2(by - ay, bx - ax);
  const head = 3 + 2 * width;
  context.lineWidth = width;
  context.strokeStyle = colour;
  context.fillStyle = colour;
  context.beginPath();
  context.moveTo(ax, ay);
  context.lineTo(bx - 0.7 * head * Math.cos(angle), by - 0.7 * head * Math.sin(angle));
  context.stroke();
  context.setLineDash([]);
  context.beginPath();
  context.moveTo(bx, by);
  context.lineTo(bx - head * Math.cos(angle - 0.45), by - head * Math.sin(angle - 0.45));
  context.lineTo(bx - head * Math.cos(angle + 0.45), by - head * Math.sin(angle + 0.45));
  context.closePath();
  context.fill();
}

/** Draw who yields to whom, and where it will hold; `radiusOf` a robot is in pixels. */
export function drawYields(context, toScreen, yields, radiusOf) {
  context.lineCap = "butt";
  for (const { robot, peer, kind, hold, colour } of yields) {
    const from = toScreen(robot.x, robot.y, robot.z);
    if (peer) {
      const to = toScreen(peer.x, peer.y, peer.z);
      const [start, end] = shortened(from, to, radiusOf(robot), radiusOf(peer) + 2);
      context.setLineDash(kind === "limited" ? [2, 3] : [8, 4]);
      drawArrow(context, start, end, colour, kind === "limited" ? 1.5 : 2.5);
    }
    if (hold) {
      const place = toScreen(...hold);
      drawDashes(context, [from, place], [3, 4], colour, 2);
      drawCross(context, ...place, 7, colour, 3);
    }
  }
  context.setLineDash([]);
}

/** Return the ends of a line without the parts within circles around them. */
function shortened([ax, ay], [bx, by], atStart, atEnd) {
  const length = Math.hypot(bx - ax, by - ay);
  const share = length > atStart + atEnd + 8 ? 1 / length : 0;
  const [ux, uy] = [(bx - ax) * share, (by - ay) * share];
  return [
    [ax + ux * atStart, ay + uy * atStart],
    [bx - ux * atEnd, by - uy * atEnd],
  ];
}

/**
 * Draw tracks and suspects as rings in the colour of the robot that tracks them, with lines to
 * where they are in a second.
 */
export function drawTracks(context, toScreen, tracks) {
  for (const { x, y, vx, vy, radius, kind, colour } of tracks) {
    const { fill, ring, dash } = TRACK_LOOKS[kind];
    const corners = Array.from({ length: TRACK_CORNERS + 1 }, (_, i) => {
      const angle = (2 * Math.PI * i) / TRACK_CORNERS;
      return toScreen(x + radius * Math.cos(angle), y + radius * Math.sin(angle));
    });
    drawDashes(context, corners, dash, withAlpha(colour, ring), 2);
    context.fillStyle = fill;
    context.fill();
    if (Math.hypot(vx, vy) >= SLOWEST_MPS) {
      const ends = [toScreen(x, y), toScreen(x + AHEAD_S * vx, y + AHEAD_S * vy)];
      drawDashes(context, ends, [], withAlpha(colour, ring), 2);
    }
  }
}

/** Draw particles, and the ellipse and sector in which poses are with 95 %; lost ones dashed. */
export function drawLocalizations(context, toScreen, localizations) {
  for (const { x, y, yaw, variances, points, colour, isLost } of localizations) {
    context.fillStyle = withAlpha(colour, 0.55);
    for (let i = 0; i < points.length; i += 2) {
      const [px, py] = toScreen(points[i], points[i + 1]);
      context.fillRect(px - 1, py - 1, 2, 2);
    }
    if (!Number.isFinite(x) || !variances.every(Number.isFinite)) {
      continue;
    }
    const corners = ellipse(x, y, variances).map((place) => toScreen(...place));
    drawDashes(context, corners, isLost ? [5, 4] : [], colour, 2);
    context.fillStyle = withAlpha(colour, 0.15);
    context.fill();
    const half = Math.min(Math.PI, 1.96 * Math.sqrt(Math.max(0, variances[3])));
    const tips = [-half, 0, half].map((turn) => ahead(toScreen, { x, y, yaw: yaw + turn }, 34));
    drawDashes(context, [tips[0], toScreen(x, y), tips[2]], [3, 3], colour, 1);
    drawArrow(context, toScreen(x, y), tips[1], colour, 2);
  }
}

/** Return the ellipse of a covariance that has 95 % of a normal distribution. */
function ellipse(x, y, [xx, xy, yy]) {
  const [mean, turned] = [(xx + yy) / 2, Math.hypot((xx - yy) / 2, xy)];
  const angle = Math.atan2(2 * xy, xx - yy) / 2;
  const [a, b] = [mean + turned, mean - turned].map((v) => Math.sqrt(CHI_SQUARED * Math.max(v, 0)));
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  return Array.from({ length: TRACK_CORNERS + 1 }, (_, i) => {
    const t = (2 * Math.PI * i) / TRACK_CORNERS;
    const [u, v] = [a * Math.cos(t), b * Math.sin(t)];
    return [x + cos * u - sin * v, y + sin * u + cos * v];
  });
}

/** Draw contacts; recent ones with their time. */
export function drawContacts(context, toScreen, contacts) {
  for (const { x, y, time_s, isFresh } of contacts) {
    const [px, py] = toScreen(x, y);
    context.globalAlpha = isFresh ? 1 : 0.45;
    drawCross(context, px, py, isFresh ? 7 : 5, INK.contact, 2.5);
    if (isFresh) {
      disc(context, px, py, 11, "transparent", INK.contact);
      tag(context, `${time_s.toFixed(1)} s`, px, py + 20, INK.contact);
    }
  }
  context.globalAlpha = 1;
}

/** Draw a diagonal cross with a light edge. */
export function drawCross(context, px, py, radius, colour, width = 2.5) {
  for (const [thickness, ink] of [[width + 2, INK.plate], [width, colour]]) {
    context.beginPath();
    context.moveTo(px - radius, py - radius);
    context.lineTo(px + radius, py + radius);
    context.moveTo(px - radius, py + radius);
    context.lineTo(px + radius, py - radius);
    context.lineWidth = thickness;
    context.strokeStyle = ink;
    context.stroke();
  }
}

/** Draw a filled disc with an edge. */
export function disc(context, px, py, radius, fill, edge, width = 2) {
  context.beginPath();
  context.arc(px, py, radius, 0, 2 * Math.PI);
  context.fillStyle = fill;
  context.fill();
  context.lineWidth = width;
  context.strokeStyle = edge;
  context.stroke();
}

/** Write a short text around a place. */
export function write(context, text, px, py, size, ink) {
  context.font = `600 ${size}px ${FONT}`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = ink;
  context.fillText(text, px, py + 0.5);
}

/** Return how wide the plate of a text is. */
export function tagWidth(context, text) {
  context.font = `600 11px ${FONT}`;
  return context.measureText(text).width + 8;
}

/** Write a text on a plate. */
export function tag(context, text, px, py, ink) {
  const width = tagWidth(context, text);
  context.beginPath();
  context.roundRect(px - width / 2, py - 8, width, 16, 4);
  context.fillStyle = withAlpha(INK.plate, 0.92);
  context.fill();
  write(context, text, px, py, 11, ink);
}
