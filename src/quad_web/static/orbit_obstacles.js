/**
 * View in space: obstacles that move. Their shapes are built once for a scene, and then placed.
 */

import * as THREE from "three";

import { INK } from "./colours.js";
import { levelOf } from "./fleet.js";
import { addSolid, disposeParts } from "./orbit_scene.js";

const TIP_ABOVE_M = 0.01;
const FAINT = 0.55; // above or below the flying altitude

/** All moving obstacles of a scene. */
export class MovingObstacles {
  constructor() {
    this.object = new THREE.Group();
    this._revision = null;
    this._solids = [];
  }

  /** Show the obstacles of a fleet. */
  update({ scene, sceneRevision, obstacles }) {
    if (sceneRevision !== this._revision) {
      this._revision = sceneRevision;
      this._build(scene);
    }
    for (const solid of this._solids) {
      solid.visible = false;
    }
    for (const { index, x, y, yaw, hasHeading } of obstacles) {
      const solid = this._solids[index];
      solid.visible = true;
      solid.position.set(x, y, 0);
      solid.rotation.z = yaw;
      if (solid.userData.tip) {
        solid.userData.tip.visible = hasHeading;
      }
    }
  }

  _build(scene) {
    disposeParts(this.object);
    this.object.clear();
    this._solids = (scene?.moving ?? []).map((solid) => {
      const group = new THREE.Group();
      const isAcross = levelOf(solid, scene.altitude_m) === "across";
      const look = { color: INK.moving, edge: INK.movingEdge, opacity: isAcross ? 1 : FAINT };
      addSolid(group, { ...solid, x: 0, y: 0, yaw: 0 }, look);
      if (solid.person) {
        group.userData.tip = tip(solid);
        group.add(group.userData.tip);
      }
      this.object.add(group);
      return group;
    });
  }
}

/** Return a triangle on a person's head that points ahead. */
function tip({ reach, bottom, height }) {
  const z = bottom + height + TIP_ABOVE_M;
  const corners = [0.9, 0, z, -0.4, 0.5, z, -0.4, -0.5, z];
  const scaled = corners.map((length, i) => (i % 3 === 2 ? length : reach * length));
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(scaled, 3));
  const material = new THREE.MeshBasicMaterial({ color: "#ffffff", side: THREE.DoubleSide });
  return new THREE.Mesh(geometry, material);
}
