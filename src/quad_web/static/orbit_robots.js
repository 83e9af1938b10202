/**
 * View in space: quadcopters with their tilt, in one draw call for each part of all of them.
 */

import { mergeGeometries } from "BufferGeometryUtils";
import * as THREE from "three";

import { troubleOf } from "./map_robots.js";
import { linear } from "./orbit_batches.js";

const ROTOR = 0.36; // radius of a rotor, for a hull of radius 1
const ARM = (1 - ROTOR) * Math.SQRT1_2;
const CORNERS = [
  [ARM, ARM],
  [ARM, -ARM],
  [-ARM, ARM],
  [-ARM, -ARM],
];

/** All quadcopters. */
export class Quadcopters {
  constructor() {
    this.object = new THREE.Group();
    this._capacity = 0;
    this._parts = [];
  }

  /** Show robots, one of them selected, with the radii in metres of a function. */
  update(robots, selected, radiusOf) {
    if (robots.length > this._capacity) {
      this._build(2 * robots.length);
    }
    const pose = new THREE.Object3D();
    pose.rotation.order = "ZYX";
    robots.forEach((robot, i) => {
      const radius = radiusOf(robot);
      for (const { mesh, isOnGround, colourOf } of this._parts) {
        pose.position.set(robot.x, robot.y, isOnGround ? 0.02 : robot.z);
        pose.rotation.set(isOnGround ? 0 : robot.roll, isOnGround ? 0 : robot.pitch, robot.yaw);
        const isShown = Boolean(colourOf(robot, selected));
        pose.scale.setScalar(isShown ? radius : 0);
        pose.updateMatrix();
        mesh.setMatrixAt(i, pose.matrix);
        mesh.setColorAt(i, linear(colourOf(robot, selected) ?? robot.colour));
      }
    });
    for (const { mesh } of this._parts) {
      mesh.count = robots.length;
      mesh.instanceMatrix.needsUpdate = true;
      mesh.instanceColor.needsUpdate = true;
    }
  }

  _build(capacity) {
    for (const { mesh } of this._parts) {
      this.object.remove(mesh);
      mesh.geometry.dispose();
      mesh.material.dispose();
      mesh.dispose();
    }
    this._capacity = capacity;
    const own = ({ colour }) => colour;
    const glass = { transparent: true, opacity: 0.85, side: THREE.DoubleSide };
    const faint = { ...glass, opacity: 0.18, depthWrite: false };
    this._parts = [
      this._part(airframe(), new THREE.MeshLambertMaterial(), own),
      this._part(nose(), new THREE.MeshLambertMaterial(), () => "#ffffff"),
      this._part(rotors(), new THREE.MeshBasicMaterial({ ...glass, vertexColors: true }), own),
      this._part(ring(0.96, 1), new THREE.MeshBasicMaterial(glass), own),
      this._part(ring(1.08, 1.2), new THREE.MeshBasicMaterial(glass), troubleOf),
      this._part(ring(1.24, 1.38), new THREE.MeshBasicMaterial(glass), selectedIn("#ffffff")),
      this._part(ring(1.38, 1.52), new THREE.MeshBasicMaterial(glass), selectedIn("#000000")),
      this._part(new THREE.CircleGeometry(1, 24), new THREE.MeshBasicMaterial(faint), shade, true),
    ];
  }

  _part(geometry, material, colourOf, isOnGround = false) {
    const mesh = new THREE.InstancedMesh(geometry, material, this._capacity);
    mesh.frustumCulled = false;
    mesh.renderOrder = material.transparent ? 3 : 0;
    this.object.add(mesh);
    return { mesh, colourOf, isOnGround };
  }
}

const shade = () => "#000000";

/** Return a function with the colour of a part that the selected robot alone has. */
const selectedIn = (colour) => (robot, selected) => (robot === selected ? colour : undefined);

/** Body and arms, x ahead, within a circle of radius 1. */
function airframe() {
  const body = new THREE.SphereGeometry(0.34, 16, 10).scale(1.3, 0.8, 0.5);
  const arms = [1, -1].map((side) =>
    new THREE.BoxGeometry(2 * Math.SQRT2 * ARM, 0.09, 0.07).rotateZ((side * Math.PI) / 4),
  );
  const hubs = CORNERS.map(([x, y]) =>
    new THREE.CylinderGeometry(0.08, 0.08, 0.22, 8).rotateX(Math.PI / 2).translate(x, y, 0.07),
  );
  return mergeGeometries([body, ...arms, ...hubs]);
}

function nose() {
  return new THREE.ConeGeometry(0.17, 0.4, 10).rotateZ(-Math.PI / 2).translate(0.55, 0, 0.05);
}

/** Four discs; the front ones are brighter. */
function rotors() {
  const discs = CORNERS.map(([x, y]) => {
    const disc = new THREE.CircleGeometry(ROTOR, 20).translate(x, y, 0.19);
    const share = x > 0 ? 1 : 0.6;
    const values = new Float32Array(disc.attributes.position.count * 3).fill(share);
    return disc.setAttribute("color", new THREE.BufferAttribute(values, 3));
  });
  return mergeGeometries(discs);
}

function ring(inner, outer) {
  return new THREE.RingGeometry(inner, outer, 32);
}
