/**
 * The arena from above, on a canvas.
 */

import { boundsOf } from "./fleet.js";
import {
  drawContacts,
  drawGoals,
  drawLocalizations,
  drawTracks,
  drawYields,
} from "./map_marks.js";
import { drawCells, drawPaths, drawScans } from "./map_paths.js";
import { drawNumbers, drawRobot, drawnRadius } from "./map_robots.js";
import { CostmapImages, drawCostmaps, drawFloor, drawObstacles, drawSolids } from "./map_scene.js";
import { Viewport } from "./viewport.js";

const LEAST_SHARE = 0.8; // of the scale, for panels that stay free

/**
 * Map view. `MapView` and `OrbitView` have the same methods, so tools work in both.
 */
export class MapView {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.viewport = new Viewport();
    this._context = canvas.getContext("2d", { alpha: false });
    this._base = document.createElement("canvas");
    this._baseContext = this._base.getContext("2d", { alpha: false });
    this._baseState = "";
    this._images = new CostmapImages();
    this._ratio = 1;
    this._middle_px = 0; // right of the canvas's own
  }

  /** Whether drags and pinches that no tool claims are left to the view itself. */
  get ownsGestures() {
    return false;
  }

  /** Whether a length has the same size everywhere. */
  get hasScale() {
    return true;
  }

  /** Set the size in CSS pixels, and the device pixels for each of them. */
  resize(width, height, ratio) {
    Object.assign(this.viewport, { width, height });
    this._ratio = ratio;
    for (const canvas of [this.canvas, this._base]) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    this._baseState = "";
  }

  /** Return pixels of a point in the arena; the map view has no use for the altitude. */
  toScreen(x, y) {
    return this.viewport.toScreen(x, y);
  }

  /** Return metres of a pixel. */
  toWorld(px, py) {
    return this.viewport.toWorld(px, py);
  }

  /** Metres of a pixel. */
  get metresPerPixel() {
    return 1 / this.viewport.scale;
  }

  /** Move the content by pixels. */
  panBy(dx, dy) {
    this.viewport.panBy(dx, dy);
  }

  /** Zoom about a pixel. */
  zoomAt(px, py, factor) {
    this.viewport.zoomAt(px, py, factor);
  }

  /** Show the whole arena; pixels that panels cover stay free, unless it becomes much smaller. */
  fit(fleet, covered) {
    const { viewport } = this;
    const margin = Math.min(20, viewport.width / 30);
    const insets = { left: margin, right: margin, top: margin, bottom: margin };
    viewport.fit(boundsOf(fleet), insets);
    const whole = viewport.scale;
    const free = Object.fromEntries(
      Object.entries(insets).map(([side, least]) => [side, Math.max(least, covered[side] ?? 0)]),
    );
    viewport.fit(boundsOf(fleet), free);
    this._middle_px = (free.left - free.right) / 2;
    if (viewport.scale < LEAST_SHARE * whole) {
      viewport.fit(boundsOf(fleet), insets);
      this._middle_px = 0;
    }
  }

  /** Put a robot into the middle of what no panel covers. */
  follow(robot) {
    this.viewport.x = robot.x - this._middle_px / this.viewport.scale;
    this.viewport.y = robot.y;
  }

  /** Return the radius in pixels of the circle that a robot is clicked in. */
  reachOf(robot) {
    return drawnRadius(robot, this.viewport.scale);
  }

  /** Draw everything. */
  draw(fleet, { labels }) {
    this._drawBase(fleet);
    const context = this._context;
    const { viewport } = this;
    const toScreen = (x, y) => viewport.toScreen(x, y);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this._base, 0, 0);
    context.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
    drawObstacles(context, viewport, fleet.obstacles, fleet.altitude);
    drawCells(context, viewport, fleet.cells);
    drawTracks(context, toScreen, fleet.tracks);
    drawPaths(context, viewport, fleet);
    drawGoals(context, toScreen, fleet.goals, fleet.selected !== null);
    drawScans(context, viewport, fleet.scans);
    drawYields(context, toScreen, fleet.yields, (robot) => this.reachOf(robot));
    this._drawRobots(context, fleet, labels);
    drawLocalizations(context, toScreen, fleet.localizations);
    drawContacts(context, toScreen, fleet.contacts);
  }

  /** Floor, costmaps and obstacles; drawn again only when they or the section have changed. */
  _drawBase(fleet) {
    const { viewport } = this;
    const state = JSON.stringify([
      viewport.x,
      viewport.y,
      viewport.scale,
      fleet.sceneRevision,
      fleet.costmaps.map(({ key, revision }) => [key, revision]),
    ]);
    if (state === this._baseState) {
      return;
    }
    this._baseState = state;
    const context = this._baseContext;
    context.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
    drawFloor(context, viewport, fleet.scene);
    this._images.keep(fleet.costmaps);
    drawSolids(context, viewport, fleet.scene);
    drawCostmaps(context, viewport, fleet.costmaps, this._images);
  }

  _drawRobots(context, { robots, selected }, labels) {
    const { viewport } = this;
    for (const robot of robots) {
      if (robot !== selected) {
        drawRobot(context, viewport, robot, false);
      }
    }
    if (selected) {
      drawRobot(context, viewport, selected, true);
    }
    if (labels) {
      drawNumbers(context, numberMarks(this, robots, selected));
    }
  }
}

/** Return what `drawNumbers` needs of each robot. */
export function numberMarks(view, robots, selected) {
  return robots.map((robot) => {
    const [px, py] = view.toScreen(robot.x, robot.y, robot.z);
    const { index, colour } = robot;
    return { px, py, radius: view.reachOf(robot), index, colour, isSelected: robot === selected };
  });
}
