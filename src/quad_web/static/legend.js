/**
 * The legend of the arena, with a sample of each thing that is shown.
 */

import { costColour, INK, mix } from "./colours.js";
import { make } from "./dom.js";
import { YIELD_COLOURS } from "./fleet.js";
import {
  drawArrow,
  drawContacts,
  drawCross,
  drawGoal,
  drawTracks,
  GOAL_SIZES,
} from "./map_marks.js";
import { drawPaths, drawScans } from "./map_paths.js";
import { drawRobot } from "./map_robots.js";
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
    drawArrow(context, [3, HEIGHT / 2], [WIDTH - 3, HEIGHT / 2], YIELD_COLOURS[kind]);
    context.setLineDash([]);
  };
}

function cell(context) {
  context.setLineDash([5, 4]);
  context.strokeStyle = mix(COLOUR, "#ffffff", 0.3);
  context.strokeRect(4, 4, WIDTH - 8, HEIGHT - 8);
}

const contact = (context) =>
  drawContacts(context, toScreen, [{ x: 0, y: 0, time_s: 0, isFresh: false }]);
const hold = (context) => drawCross(context, WIDTH / 2, HEIGHT / 2, 6, INK.makesRoom, 3);

/**
 * Layer ("" is always shown, "map" in the map view only), what it is, and a function that draws a
 * sample.
 */
const ENTRIES = [
  ["", "Quadcopter: white nose ahead, dot leans with it", robot],
  ["", "Recovering; lost or stopped", troubled],
  ["goals", "Active goal with its yaw", goal("active", 0)],
  ["goals", "Goal to come", goal("pending", null)],
  ["goals", "Goal reached", goal("reached", null)],
  ["goals", "Goal failed", goal("failed", null)],
  ["trail", "Trail", path("trails")],
  ["plan", "Global plan", path("plans")],
  ["local_plan", "Local plan", path("localPlans")],
  ["scan", "LIDAR points", scan],
  ["cell", "Voronoi cell", cell],
  ["track", "Tracked obstacle; the line ends where it is in 1 s", track("seen")],
  ["track", "Tracked, but hidden: predicted", track("hidden")],
  ["track", "Suspect: may move", track("suspect")],
  ["yields", "Waits for the other", arrow("waits")],
  ["yields", "Makes room for the other", arrow("makes room")],
  ["yields", "Place where it will hold", hold],
  ["yields", "Limited by the other", arrow("limited")],
  ["contacts", "Contact", contact],
  ["costmap", "Cost: low to high", costs(1, 98)],
  ["costmap", "Inscribed: the centre collides", costs(99, 99)],
  ["costmap", "Lethal: an obstacle", costs(100, 100)],
  ["costmap", "Unknown", costs(-1, -1)],
  ["moving", "Moving obstacle", moving({ outline: BOX })],
  ["moving", "Person: the tip is ahead", moving({ outline: DISC, reach: 9, hasHeading: true })],
  ["map", "Obstacle at the flying altitude", solid(0, 2, true)],
  ["map", "Obstacle below it", solid(0, 0.5, false)],
  ["map", "Obstacle above it", solid(1.5, 0.5, false)],
];

/** A panel with the entries of the shown layers. */
export class Legend {
  constructor() {
    this.element = make("div", { class: "quad-legend", "aria-label": "Legend", hidden: true });
    this._layers = new Set();
  }

  /** Open or close it; return whether it is open. */
  toggle() {
    this.element.hidden = !this.element.hidden;
    this._fill();
    return !this.element.hidden;
  }

  /** Show the entries of these layers. */
  setLayers(layers) {
    this._layers = layers;
    this._fill();
  }

  _fill() {
    if (this.element.hidden) {
      return;
    }
    const hasCosts = this._layers.has("global_costmap") || this._layers.has("local_costmap");
    const isShown = (layer) =>
      !layer || (layer === "costmap" ? hasCosts : this._layers.has(layer));
    this.element.replaceChildren(
      ...ENTRIES.filter(([layer]) => isShown(layer)).map(([, text, draw]) =>
        make("div", { class: "quad-legend-entry" }, sample(draw), text),
      ),
    );
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
