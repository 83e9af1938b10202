/**
 * Map view: floor, grid, walls, obstacles and costmaps. These change rarely, so they are drawn on a
 * canvas of their own.
 */

import { INK, inkChanges, paintCosts } from "./colours.js";
import { levelOf, outlineOf } from "./fleet.js";
import { roundLength, tracePath } from "./viewport.js";

const COSTMAP_OPACITY = 0.55;
const HATCH_PX = 7;
const GRID_PX = 60; // about the distance of lines

/** Colours of solids: those at the flying altitude, and the edges of others. */
const solidLook = () => ({ fill: INK.solid, edge: INK.solidEdge, passed: INK.passed });
const wallLook = () => ({ ...solidLook(), fill: INK.wall });
const movingLook = () => ({ fill: INK.moving, edge: INK.movingEdge, passed: INK.moving });

/** Draw the floor and its grid, as far as it is seen. */
export function drawFloor(context, viewport, scene) {
  context.fillStyle = INK.background;
  context.fillRect(0, 0, viewport.width, viewport.height);
  const [left, bottom] = viewport.toWorld(0, viewport.height);
  const [right, top] = viewport.toWorld(viewport.width, 0);
  let area = [left, bottom, right, top];
  if (scene) {
    const [x0, y0] = scene.origin_m;
    const [width, depth] = scene.size_m;
    area = [x0, y0, x0 + width, y0 + depth];
    const [px, py] = viewport.toScreen(x0, y0 + depth);
    context.fillStyle = INK.floor;
    context.fillRect(px, py, width * viewport.scale, depth * viewport.scale);
  }
  const step = Math.max(roundLength((2.5 * GRID_PX) / viewport.scale) / 2, 0.05);
  drawGrid(context, viewport, step, [
    Math.max(area[0], left),
    Math.max(area[1], bottom),
    Math.min(area[2], right),
    Math.min(area[3], top),
  ]);
}

function drawGrid(context, viewport, step, [x0, y0, x1, y1]) {
  const line = (ax, ay, bx, by) => {
    const [p, q] = [viewport.toScreen(ax, ay), viewport.toScreen(bx, by)];
    context.moveTo(Math.round(p[0]) + 0.5, Math.round(p[1]) + 0.5);
    context.lineTo(Math.round(q[0]) + 0.5, Math.round(q[1]) + 0.5);
  };
  context.lineWidth = 1;
  context.strokeStyle = INK.grid;
  context.beginPath();
  for (let k = Math.ceil(x0 / step); k * step <= x1; k += 1) {
    line(k * step, y0, k * step, y1);
  }
  for (let k = Math.ceil(y0 / step); k * step <= y1; k += 1) {
    line(x0, k * step, x1, k * step);
  }
  context.stroke();
}

/** Draw walls and obstacles: solid at the flying altitude, hatched below it, outlined above it. */
export function drawSolids(context, viewport, scene) {
  if (!scene) {
    return;
  }
  for (const solid of scene.solids) {
    drawSolid(context, viewport, solid, levelOf(solid, scene.altitude_m), solidLook());
  }
  for (const wall of scene.walls) {
    drawSolid(context, viewport, wall, levelOf(wall, scene.altitude_m), wallLook());
  }
}

/** Draw obstacles that move; people who walk have a tip ahead. */
export function drawObstacles(context, viewport, obstacles, altitude) {
  for (const obstacle of obstacles) {
    drawSolid(context, viewport, obstacle, levelOf(obstacle, altitude), movingLook());
    if (obstacle.hasHeading) {
      drawHeading(context, viewport, obstacle);
    }
  }
}

/** Corners of a triangle that points ahead, in radii of a person. */
const TIP = [
  [0.9, 0],
  [-0.4, 0.5],
  [-0.4, -0.5],
];

/** Draw a white triangle that points ahead, into a person. */
function drawHeading(context, viewport, person) {
  const outline = TIP.map(([ahead, left]) => [person.reach * ahead, person.reach * left]);
  traceOutline(context, viewport, { ...person, outline });
  context.fillStyle = "#ffffff";
  context.fill();
}

function traceOutline(context, viewport, solid) {
  tracePath(context, outlineOf(solid).map(([x, y]) => viewport.toScreen(x, y)));
  context.closePath();
}

function drawSolid(context, viewport, solid, level, look) {
  traceOutline(context, viewport, solid);
  context.setLineDash(level === "high" ? [6, 4] : []);
  if (level !== "high") {
    context.fillStyle = level === "across" ? look.fill : hatch(context);
    context.fill();
  }
  context.lineWidth = level === "across" ? 1 : 1.5;
  context.strokeStyle = level === "across" ? look.edge : look.passed;
  context.stroke();
  context.setLineDash([]);
}

let hatchTile = null;
inkChanges.addEventListener("change", () => (hatchTile = null));

/** Return a pattern of diagonal lines. */
function hatch(context) {
  if (!hatchTile) {
    hatchTile = document.createElement("canvas");
    hatchTile.width = HATCH_PX;
    hatchTile.height = HATCH_PX;
    const tile = hatchTile.getContext("2d");
    tile.strokeStyle = INK.passed;
    tile.lineWidth = 1.2;
    tile.beginPath();
    for (const shift of [-HATCH_PX, 0, HATCH_PX]) {
      tile.moveTo(shift - 1, HATCH_PX + 1);
      tile.lineTo(shift + HATCH_PX + 1, -1);
    }
    tile.stroke();
  }
  return context.createPattern(hatchTile, "repeat");
}

/** Canvases with the colours of costmaps, painted again only when a costmap has changed. */
export class CostmapImages {
  constructor() {
    this._images = new Map();
  }

  /** Return the canvas of a costmap, first row at the top. */
  of({ key, revision, arrays }) {
    let image = this._images.get(key);
    if (!image) {
      image = { canvas: document.createElement("canvas"), revision: -1 };
      this._images.set(key, image);
    }
    if (image.revision !== revision) {
      paintCosts(image.canvas, arrays.costs);
      image.revision = revision;
    }
    return image.canvas;
  }

  /** Drop the canvases of costmaps that are no longer shown. */
  keep(costmaps) {
    const keys = new Set(costmaps.map(({ key }) => key));
    for (const key of this._images.keys()) {
      if (!keys.has(key)) {
        this._images.delete(key);
      }
    }
  }
}

/** Draw costmaps, the first one below the others. */
export function drawCostmaps(context, viewport, costmaps, images) {
  for (const costmap of costmaps) {
    const { x, y, yaw, resolution_m } = costmap.data;
    const [px, py] = viewport.toScreen(x, y);
    const cell = resolution_m * viewport.scale;
    context.save();
    context.translate(px, py);
    context.rotate(-yaw);
    context.scale(cell, -cell); // the first row of a costmap is its lower edge
    context.globalAlpha = COSTMAP_OPACITY;
    context.imageSmoothingEnabled = false;
    context.drawImage(images.of(costmap), 0, 0);
    context.restore();
  }
}
