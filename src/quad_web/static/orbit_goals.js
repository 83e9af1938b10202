/**
 * View in space: goals as discs at the flying altitude, with an arrow for the yaw.
 */

import { mergeGeometries } from "BufferGeometryUtils";
import * as THREE from "three";

import { INK, mix } from "./colours.js";
import { linear } from "./orbit_batches.js";

const RADIUS_PX = 9;
const ACTIVE = 1.35; // times as large
const MANY_GOALS = 60;
const FONT = "Roboto, system-ui, sans-serif";

/** All goals. */
export class GoalMarks {
  constructor() {
    this.object = new THREE.Group();
    this._capacity = 0;
    this._parts = {};
  }

  /**
   * Show goals.
   *
   * @param {object} fleet As in `fleet.js`.
   * @param {number} pixel Metres.
   */
  update({ goals, selected, altitude }, pixel) {
    if (goals.length > this._capacity) {
      this._build(2 * goals.length);
    }
    const pose = new THREE.Object3D();
    const put = (mesh, i, goal, scale, colour) => {
      pose.position.set(goal.x, goal.y, altitude - 0.03);
      pose.rotation.z = goal.yaw ?? 0;
      pose.scale.setScalar(scale);
      pose.updateMatrix();
      mesh.setMatrixAt(i, pose.matrix);
      mesh.setColorAt(i, linear(colour));
    };
    const areMany = goals.length > MANY_GOALS;
    goals.forEach((goal, i) => {
      const isActive = goal.state === "active";
      const isFaint = selected !== null && !goal.isOfSelected;
      const size = (areMany && !goal.isOfSelected ? 0.45 : 1) * (isActive ? ACTIVE : 1);
      const scale = RADIUS_PX * size * pixel;
      const faded = (goal.state === "reached" ? 0.55 : 0) + (isFaint ? 0.3 : 0);
      const colour = goal.state === "failed" ? INK.fault : mix(goal.colour, "#ffffff", faded);
      put(this._parts.ring, i, goal, scale, colour);
      put(this._parts.disc, i, goal, scale, isActive ? colour : "#ffffff");
      put(this._parts.arrow, i, goal, goal.yaw === null ? 0 : scale, colour);
    });
    for (const mesh of Object.values(this._parts)) {
      mesh.count = goals.length;
      mesh.instanceMatrix.needsUpdate = true;
      mesh.instanceColor.needsUpdate = true;
    }
  }

  _build(capacity) {
    for (const mesh of Object.values(this._parts)) {
      this.object.remove(mesh);
      mesh.geometry.dispose();
      mesh.material.dispose();
      mesh.dispose();
    }
    this._capacity = capacity;
    this._parts = {
      disc: this._part(new THREE.CircleGeometry(1, 24), 0.75),
      ring: this._part(new THREE.RingGeometry(0.8, 1.05, 28), 1),
      arrow: this._part(arrow(), 1),
    };
  }

  _part(geometry, opacity) {
    const material = new THREE.MeshBasicMaterial({
      transparent: true,
      opacity,
      side: THREE.DoubleSide,
      depthWrite: false,
    });
    const mesh = new THREE.InstancedMesh(geometry, material, this._capacity);
    mesh.frustumCulled = false;
    mesh.renderOrder = 1;
    this.object.add(mesh);
    return mesh;
  }
}

/** A flat arrow along x, beginning at a disc of radius 1. */
function arrow() {
  const shaft = new THREE.PlaneGeometry(0.9, 0.28).translate(1.45, 0, 0);
  const head = new THREE.CircleGeometry(0.55, 3).translate(2.1, 0, 0);
  return mergeGeometries([shaft, head]);
}

/** Write the numbers of goals, and cross the failed ones. */
export function drawGoalNumbers(context, toScreen, { goals, selected }) {
  const areMany = goals.length > MANY_GOALS;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.font = `700 11px ${FONT}`;
  context.lineWidth = 3;
  context.strokeStyle = "rgba(255,255,255,0.9)";
  for (const { x, y, index, state, colour, isOfSelected } of goals) {
    if (areMany && !isOfSelected) {
      continue;
    }
    const [px, py] = toScreen(x, y);
    const text = state === "failed" ? "✕" : String(index + 1);
    context.globalAlpha = state === "reached" || (selected && !isOfSelected) ? 0.6 : 1;
    context.strokeText(text, px, py);
    context.fillStyle = state === "failed" ? INK.fault : mix(colour, "#000000", 0.5);
    context.fillText(text, px, py);
  }
  context.globalAlpha = 1;
}
