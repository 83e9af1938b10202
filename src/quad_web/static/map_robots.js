/**
 * Map view: quadcopters from above, with heading, tilt, hull, number and state.
 */

import { INK, mix, textOn, withAlpha } from "./colours.js";
import { tiltOf } from "./fleet.js";
import { disc, FONT, write } from "./map_marks.js";
import { tracePath } from "./viewport.js";

const LEAST_RADIUS_PX = 8;
const ICON_BELOW_PX = 11; // drawn as a dart instead of with rotors
const TILT_FROM_PX = 13;
const FULL_TILT = 0.35; // sine of the tilt that moves the mark to the hull
const RINGS_PX = [[7.5, 3], [4.5, 3]]; // beyond the hull, and width, of the selected robot's

/** Return the colour of a robot in trouble, undefined without any. */
export function troubleOf({ state }) {
  return { lost: INK.fault, stopped: INK.fault, recovering: INK.waits }[state];
}

const NOSE = [[0.78, 0], [0.34, 0.2], [0.34, -0.2]];
const DART = [[0.8, 0], [-0.55, 0.55], [-0.25, 0], [-0.55, -0.55]];

/** Return the radius in pixels that a robot is drawn with. */
export function drawnRadius(robot, scale) {
  return Math.max(robot.radius * scale, LEAST_RADIUS_PX);
}

/** Draw a quadcopter. */
export function drawRobot(context, viewport, robot, isSelected) {
  const [px, py] = viewport.toScreen(robot.x, robot.y);
  const radius = drawnRadius(robot, viewport.scale);
  if (isSelected) {
    ring(context, px, py, radius);
  }
  drawHull(context, robot, px, py, radius);
  context.save();
  context.translate(px, py);
  context.rotate(-robot.yaw);
  (radius < ICON_BELOW_PX ? drawDart : drawAirframe)(context, radius, robot.colour);
  context.restore();
  if (radius >= TILT_FROM_PX) {
    drawTilt(context, robot, px, py, radius);
  }
}

/** A double ring, black and white, which no robot and no state has. */
function ring(context, px, py, radius) {
  RINGS_PX.forEach(([beyond, width], i) => {
    disc(context, px, py, radius + beyond, "transparent", ["#000000", "#ffffff"][i], width);
  });
}

/** The hull that collisions are counted with; its colour tells of trouble. */
function drawHull(context, robot, px, py, radius) {
  const trouble = troubleOf(robot);
  const fill = withAlpha(trouble ?? robot.colour, trouble ? 0.25 : 0.1);
  const edge = trouble ?? withAlpha(robot.colour, 0.65);
  disc(context, px, py, radius + (trouble ? 2 : 0), fill, edge, trouble ? 2.5 : 1);
}

/** Four rotors, arms and a body with a white nose, within a circle. */
function drawAirframe(context, radius, colour) {
  const rotor = 0.36 * radius;
  const arm = (radius - rotor) * Math.SQRT1_2;
  const dark = mix(colour, INK.strong, 0.45);
  context.lineCap = "round";
  context.lineWidth = Math.max(1.5, 0.12 * radius);
  context.strokeStyle = dark;
  context.beginPath();
  context.moveTo(-arm, -arm);
  context.lineTo(arm, arm);
  context.moveTo(-arm, arm);
  context.lineTo(arm, -arm);
  context.stroke();
  for (const [x, y] of [[arm, arm], [arm, -arm], [-arm, arm], [-arm, -arm]]) {
    const fill = withAlpha(colour, x > 0 ? 0.75 : 0.4);
    disc(context, x, y, rotor, fill, dark, Math.max(1, 0.06 * radius));
  }
  context.beginPath();
  context.ellipse(0, 0, 0.42 * radius, 0.26 * radius, 0, 0, 2 * Math.PI);
  context.fillStyle = colour;
  context.fill();
  context.stroke();
  fillWhite(context, radius, NOSE);
  context.stroke();
}

/** A disc with an arrowhead, for robots that are too small for rotors. */
function drawDart(context, radius, colour) {
  context.beginPath();
  context.arc(0, 0, radius, 0, 2 * Math.PI);
  context.fillStyle = colour;
  context.fill();
  fillWhite(context, radius, DART);
}

/** Fill a polygon, whose corners are in radii. */
function fillWhite(context, radius, corners) {
  tracePath(context, corners.map(([x, y]) => [x * radius, y * radius]));
  context.closePath();
  context.fillStyle = "#ffffff";
  context.fill();
}

/** A dot that moves to where the quadcopter leans, as the bubble of a level. */
function drawTilt(context, robot, px, py, radius) {
  const [east, north] = tiltOf(robot);
  const reach = (0.85 * radius) / FULL_TILT;
  const length = Math.hypot(east, north) * reach;
  const limit = Math.min(1, radius / Math.max(length, 1e-6));
  const [dx, dy] = [east * reach * limit, -north * reach * limit];
  context.lineWidth = Math.max(1.5, 0.06 * radius);
  context.strokeStyle = "#ffffff";
  context.beginPath();
  context.moveTo(px, py);
  context.lineTo(px + dx, py + dy);
  context.stroke();
  disc(context, px + dx, py + dy, Math.max(2, 0.1 * radius), "#ffffff", INK.text, 1);
}

/** Draw numbers beside robots, the selected one first; none covers another one. */
export function drawNumbers(context, marks) {
  const size = marks.length > 40 ? 10 : 12;
  const height = size + 4;
  const taken = [];
  context.font = `600 ${size}px ${FONT}`;
  const ordered = [...marks].sort((a, b) => b.isSelected - a.isSelected);
  for (const { px, py, radius, index, colour, isSelected } of ordered) {
    const text = String(index);
    const width = Math.max(height, context.measureText(text).width + 8);
    const box = [px + 0.6 * radius, py - 0.6 * radius - height, width, height];
    if (!isSelected && taken.some((other) => overlap(box, other))) {
      continue;
    }
    taken.push(box);
    context.beginPath();
    context.roundRect(...box, height / 2);
    context.fillStyle = colour;
    context.fill();
    context.lineWidth = 1.5;
    context.strokeStyle = "#ffffff";
    context.stroke();
    write(context, text, box[0] + width / 2, box[1] + height / 2, size, textOn(colour));
  }
}

function overlap([ax, ay, aw, ah], [bx, by, bw, bh]) {
  return ax < bx + bw && bx < ax + aw && ay < by + bh && by < ay + ah;
}
