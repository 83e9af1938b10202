/**
 * The arena in space, drawn with three.js on demand: when data has come or the camera has moved.
 */

import * as THREE from "three";
import { OrbitControls } from "OrbitControls";

import { INK } from "./colours.js";
import { boundsOf } from "./fleet.js";
import {
  drawContacts,
  drawGoals,
  drawLocalizations,
  drawTracks,
  drawYields,
} from "./map_marks.js";
import { drawNumbers } from "./map_robots.js";
import { numberMarks } from "./map_view.js";
import { Lines, Points, Ribbons } from "./orbit_batches.js";
import { MovingObstacles } from "./orbit_obstacles.js";
import { Quadcopters } from "./orbit_robots.js";
import { CostmapPlanes, disposeParts, sceneGroup } from "./orbit_scene.js";
import { OUTSIDE } from "./viewport.js";

const FIELD_OF_VIEW_DEG = 45;
const ELEVATION_RAD = (52 * Math.PI) / 180;
const LEAST_RADIUS_PX = 7;
const MARGIN = 1.04;
const FARTHEST = 4; // arenas away that a pixel may still be a place on

/** View in space; see `MapView` for what the methods do. */
export class OrbitView {
  /**
   * The host has `moved()`, called when the camera has, and `lost()` when the browser has taken the
   * graphics away. Throws an error without WebGL.
   */
  constructor(root, overlay, host) {
    const isSoftware = probe();
    this.canvas = document.createElement("canvas");
    this.canvas.className = "quad-orbit";
    this._renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: !isSoftware });
    this._mostRatio = isSoftware ? 1 : 2;
    this.canvas.addEventListener("webglcontextlost", () => host.lost());
    root.insertBefore(this.canvas, overlay);
    this._camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.05, 1000);
    this._camera.up.set(0, 0, 1);
    this._controls = new OrbitControls(this._camera, overlay);
    this._controls.maxPolarAngle = 0.495 * Math.PI;
    this._controls.addEventListener("change", () => host.moved());
    this._width = 1;
    this._height = 1;
    this._altitude = 1;
    this._covered = { left: 0, right: 0 };
    this._build();
  }

  _build() {
    this._scene = new THREE.Scene();
    this._scene.background = new THREE.Color(INK.background);
    const sun = new THREE.DirectionalLight("#ffffff", 1.3);
    sun.position.set(-0.4, -0.7, 1);
    this._scene.add(new THREE.HemisphereLight("#ffffff", "#c4ccd6", 2.6), sun);
    this._sceneRevision = null;
    this._costmaps = new CostmapPlanes();
    this._obstacles = new MovingObstacles();
    this._quadcopters = new Quadcopters();
    this._ribbons = new Ribbons();
    this._points = new Points(3);
    this._lines = new Lines();
    for (const part of [
      this._costmaps,
      this._obstacles,
      this._quadcopters,
      this._ribbons,
      this._points,
      this._lines,
    ]) {
      this._scene.add(part.object);
    }
  }

  get ownsGestures() {
    return true;
  }

  /** A length has no fixed size on the screen. */
  get hasScale() {
    return false;
  }

  resize(width, height, ratio) {
    this._width = width;
    this._height = height;
    this._renderer.setPixelRatio(Math.min(ratio, this._mostRatio));
    this._renderer.setSize(width, height, false);
    this._updateProjection();
  }

  toScreen(x, y, z = this._altitude) {
    const point = new THREE.Vector3(x, y, z).applyMatrix4(this._camera.matrixWorldInverse);
    if (point.z > -this._camera.near) {
      return OUTSIDE;
    }
    point.applyMatrix4(this._camera.projectionMatrix);
    return [((point.x + 1) / 2) * this._width, ((1 - point.y) / 2) * this._height];
  }

  /** Return the place at the flying altitude, null if the pixel shows none. */
  toWorld(px, py) {
    const pixel = new THREE.Vector2(
      (2 * px) / this._width - 1,
      1 - (2 * py) / this._height,
    );
    const caster = new THREE.Raycaster();
    caster.setFromCamera(pixel, this._camera);
    const plane = new THREE.Plane(new THREE.Vector3(0, 0, 1), -this._altitude);
    const hit = caster.ray.intersectPlane(plane, new THREE.Vector3());
    const limit = FARTHEST * this._camera.position.distanceTo(this._controls.target);
    return hit && hit.distanceTo(this._controls.target) < limit ? [hit.x, hit.y] : null;
  }

  get metresPerPixel() {
    return this._metresPerPixelAt(this._controls.target);
  }

  _metresPerPixelAt(point) {
    const distance = this._camera.position.distanceTo(point);
    return (2 * distance * Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360)) / this._height;
  }

  panBy(dx, dy) {
    const ahead = new THREE.Vector3().subVectors(this._controls.target, this._camera.position);
    const azimuth = Math.atan2(ahead.y, ahead.x);
    const [right, up] = [-dx * this.metresPerPixel, dy * this.metresPerPixel];
    this._shift(
      right * Math.sin(azimuth) + up * Math.cos(azimuth),
      -right * Math.cos(azimuth) + up * Math.sin(azimuth),
    );
  }

  zoomAt(_px, _py, factor) {
    this._camera.position
      .sub(this._controls.target)
      .multiplyScalar(1 / factor)
      .add(this._controls.target);
    this._controls.update();
  }

  fit(fleet, covered) {
    const { minX, minY, maxX, maxY } = boundsOf(fleet);
    const [width, depth] = [maxX - minX, maxY - minY];
    const isWide = this._width > 2.5 * (covered.left + covered.right);
    this._covered = isWide ? covered : { left: 0, right: 0 };
    const share = 1 - (this._covered.left + this._covered.right) / this._width;
    const half = Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360);
    const seenDepth = depth * Math.sin(ELEVATION_RAD) + 2 * fleet.altitude;
    // The upper edge of the front wall is closer than the middle, which is a little before the
    // arena's own.
    const nearer = 0.56 * depth * Math.cos(ELEVATION_RAD) + topOf(fleet) * Math.sin(ELEVATION_RAD);
    const forWidth = width / 2 / half / this._camera.aspect / share + nearer;
    const distance = MARGIN * Math.max(seenDepth / 2 / half + nearer / 2, forWidth);
    this._controls.target.set((minX + maxX) / 2, (minY + maxY) / 2 - 0.06 * depth, 0);
    this._camera.position.set(
      this._controls.target.x,
      this._controls.target.y - distance * Math.cos(ELEVATION_RAD),
      distance * Math.sin(ELEVATION_RAD),
    );
    this._camera.far = 10 * distance;
    this._camera.near = distance / 1000;
    this._updateProjection();
    this._controls.update();
  }

  /** Keep the middle of the picture in the middle of what no panel covers. */
  _updateProjection() {
    const shift = (this._covered.left - this._covered.right) / 2;
    this._camera.aspect = this._width / this._height;
    this._camera.setViewOffset(this._width, this._height, -shift, 0, this._width, this._height);
  }

  follow(robot) {
    this._shift(robot.x - this._controls.target.x, robot.y - this._controls.target.y);
  }

  _shift(dx, dy) {
    const step = new THREE.Vector3(dx, dy, 0);
    this._controls.target.add(step);
    this._camera.position.add(step);
    this._camera.lookAt(this._controls.target);
    this._camera.updateMatrixWorld();
  }

  reachOf(robot) {
    return this._radiusOf(robot) / this._metresPerPixelAt(robot);
  }

  /** Radius that a robot is drawn with, at least some pixels. */
  _radiusOf(robot) {
    return Math.max(robot.radius, LEAST_RADIUS_PX * this._metresPerPixelAt(robot));
  }

  /** Leave the pointer to a tool. */
  setBusy(isBusy) {
    this._controls.enabled = !isBusy;
  }

  /** Start or stop listening to the pointer. */
  setActive(isActive) {
    this._controls.enabled = isActive;
  }

  draw(fleet) {
    this._altitude = fleet.altitude;
    if (fleet.sceneRevision !== this._sceneRevision) {
      this._sceneRevision = fleet.sceneRevision;
      this._replaceScene(fleet.scene);
    }
    this._camera.updateMatrixWorld();
    this._costmaps.update(fleet.costmaps);
    this._obstacles.update(fleet);
    this._quadcopters.update(fleet.robots, fleet.selected, (robot) => this._radiusOf(robot));
    this._drawPaths(fleet);
    this._renderer.render(this._scene, this._camera);
  }

  _replaceScene(scene) {
    if (this._arena) {
      this._scene.remove(this._arena);
      disposeParts(this._arena);
    }
    this._arena = sceneGroup(scene);
    this._scene.add(this._arena);
  }

  _drawPaths({ trails, plans, localPlans, cells, scans, robots, goals, altitude }) {
    const pixel = this.metresPerPixel;
    this._ribbons.clear();
    for (const path of trails) {
      this._ribbons.add(path, altitude - 0.02, path.colour, 0.45, 1.5 * pixel);
    }
    for (const path of plans) {
      this._ribbons.add(path, altitude - 0.01, path.colour, 0.95, 2 * pixel);
    }
    for (const path of localPlans) {
      this._ribbons.add(path, altitude, path.colour, 1, 4.5 * pixel, 0.5);
    }
    this._ribbons.finish();
    this._points.update(scans);
    this._lines.clear();
    for (const cell of cells) {
      this._lines.addLoop(cell, altitude, cell.colour);
    }
    for (const { x, y, z, colour } of robots) {
      this._lines.add(x, y, 0, x, y, z, colour); // shows the height above the ground
    }
    for (const { x, y, colour } of goals) {
      this._lines.add(x, y, 0, x, y, altitude, colour);
    }
    this._lines.finish();
  }

  /** Draw what has the same size at any distance, onto the overlay. */
  drawLabels(context, fleet, { labels }) {
    const toScreen = (x, y, z) => this.toScreen(x, y, z);
    drawTracks(context, toScreen, fleet.tracks);
    drawLocalizations(context, toScreen, fleet.localizations);
    const isFree = (goal) => fleet.robots.every((robot) => distance(robot, goal) > robot.radius);
    drawGoals(context, toScreen, fleet.goals.filter(isFree), fleet.selected !== null);
    drawYields(context, toScreen, fleet.yields, (robot) => this.reachOf(robot));
    drawContacts(context, toScreen, fleet.contacts);
    if (labels) {
      drawNumbers(context, numberMarks(this, fleet.robots, fleet.selected));
    }
  }

  dispose() {
    this._controls.dispose();
    this._renderer.dispose();
    this.canvas.remove();
  }
}

const distance = (a, b) => Math.hypot(a.x - b.x, a.y - b.y);

/** Return the height of the highest wall, at least the flying altitude. */
function topOf({ scene, altitude }) {
  return Math.max(altitude, ...(scene?.walls ?? []).map(({ bottom, height }) => bottom + height));
}

/**
 * Return whether the browser draws without a graphics card.
 *
 * @throws {Error} There is no WebGL.
 */
function probe() {
  const context = document.createElement("canvas").getContext("webgl2");
  if (!context) {
    throw new Error("it has no WebGL 2");
  }
  const info = context.getExtension("WEBGL_debug_renderer_info");
  const name = info ? String(context.getParameter(info.UNMASKED_RENDERER_WEBGL)) : "";
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}
