/**
 * View in space: floor, walls, obstacles and costmaps.
 */

import * as THREE from "three";

import { INK, paintCosts } from "./colours.js";
import { levelOf } from "./fleet.js";

const COSTMAP_HEIGHT_M = 0.01; // above the floor, and above the costmap below
const COSTMAP_OPACITY = 0.6;

/** Return floor, walls and obstacles as one object. */
export function sceneGroup(scene) {
  const group = new THREE.Group();
  if (!scene) {
    return group;
  }
  group.add(floor(scene), grid(scene));
  for (const solid of scene.solids) {
    const level = levelOf(solid, scene.altitude_m);
    const colour = level === "across" ? INK.solid : INK.passed;
    addSolid(group, solid, { color: colour, opacity: level === "across" ? 1 : 0.55 });
  }
  for (const wall of scene.walls) {
    addSolid(group, wall, { color: INK.wall, opacity: 0.18 });
  }
  return group;
}

function floor({ origin_m: [x, y], size_m: [width, depth] }) {
  const geometry = new THREE.PlaneGeometry(width, depth).translate(x + width / 2, y + depth / 2, 0);
  const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: INK.floor }));
  mesh.renderOrder = -2;
  return mesh;
}

function grid({ origin_m: [x, y], size_m: [width, depth] }) {
  const points = [];
  for (let u = Math.ceil(x); u <= x + width; u += 1) {
    points.push(u, y, 0.004, u, y + depth, 0.004);
  }
  for (let v = Math.ceil(y); v <= y + depth; v += 1) {
    points.push(x, v, 0.004, x + width, v, 0.004);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: INK.gridStrong }));
}

/** Release what the graphics hold of an object's parts. */
export function disposeParts(object) {
  object.traverse((part) => {
    part.geometry?.dispose();
    part.material?.dispose();
  });
}

/** Add a solid and its edges to a group. */
export function addSolid(group, solid, { color, opacity, edge = INK.solidEdge }) {
  const geometry = GEOMETRIES[solid.shape](solid)
    .rotateZ(solid.yaw)
    .translate(solid.x, solid.y, solid.bottom + solid.height / 2);
  const isGlass = opacity < 1;
  const material = new THREE.MeshLambertMaterial({
    color,
    opacity,
    transparent: isGlass,
    depthWrite: !isGlass,
  });
  const edges = new THREE.LineSegments(
    new THREE.EdgesGeometry(geometry, 30),
    new THREE.LineBasicMaterial({ color: edge }),
  );
  group.add(new THREE.Mesh(geometry, material), edges);
}

/** Geometry of each shape around its centre. */
const GEOMETRIES = {
  box: extruded,
  cylinder: extruded,
  sphere: ({ height }) => new THREE.SphereGeometry(height / 2, 24, 16),
};

function extruded({ outline, height }) {
  const base = new THREE.Shape(outline.map(([x, y]) => new THREE.Vector2(x, y)));
  const options = { depth: height, bevelEnabled: false };
  return new THREE.ExtrudeGeometry(base, options).translate(0, 0, -height / 2);
}

/** Costmaps as pictures on the floor. */
export class CostmapPlanes {
  constructor() {
    this.object = new THREE.Group();
    this._planes = new Map();
  }

  /** Show costmaps, the first one below the others. */
  update(costmaps) {
    const keys = new Set(costmaps.map(({ key }) => key));
    for (const [key, plane] of this._planes) {
      if (!keys.has(key)) {
        this._remove(key, plane);
      }
    }
    costmaps.forEach((costmap, i) => {
      const plane = this._planes.get(costmap.key) ?? this._add(costmap.key);
      const [rows, columns] = costmap.arrays.costs.shape;
      const { x, y, yaw, resolution_m } = costmap.data;
      plane.mesh.position.set(x, y, COSTMAP_HEIGHT_M * (i + 1));
      plane.mesh.rotation.z = yaw;
      plane.mesh.scale.set(columns * resolution_m, rows * resolution_m, 1);
      plane.mesh.renderOrder = i - 1;
      if (plane.revision !== costmap.revision) {
        plane.revision = costmap.revision;
        this._paint(plane, costmap.arrays.costs);
      }
    });
  }

  _add(key) {
    const geometry = new THREE.PlaneGeometry(1, 1).translate(0.5, 0.5, 0);
    const material = new THREE.MeshBasicMaterial({
      transparent: true,
      opacity: COSTMAP_OPACITY,
      depthWrite: false,
    });
    const mesh = new THREE.Mesh(geometry, material);
    const plane = { mesh, canvas: document.createElement("canvas"), revision: null };
    this._planes.set(key, plane);
    this.object.add(mesh);
    return plane;
  }

  _paint({ mesh, canvas }, costs) {
    const [rows, columns] = costs.shape;
    const { material } = mesh;
    if (!material.map || canvas.width !== columns || canvas.height !== rows) {
      material.map?.dispose();
      material.map = new THREE.CanvasTexture(canvas);
      material.map.flipY = false; // the first row of a costmap is its lower edge
      material.map.colorSpace = THREE.SRGBColorSpace;
      material.map.magFilter = THREE.NearestFilter;
      material.map.minFilter = THREE.LinearFilter;
      material.map.generateMipmaps = false;
      material.needsUpdate = true;
    }
    paintCosts(canvas, costs);
    material.map.needsUpdate = true;
  }

  _remove(key, { mesh }) {
    this._planes.delete(key);
    this.object.remove(mesh);
    mesh.material.map?.dispose();
    mesh.material.dispose();
    mesh.geometry.dispose();
  }
}
