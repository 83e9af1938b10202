/**
 * View in space: many lines, ribbons and points in one draw call each. Buffers are kept and grow.
 */

import * as THREE from "three";

const colours = new Map();

/** Return a colour as three.js calculates with it. */
export function linear(colour) {
  if (!colours.has(colour)) {
    colours.set(colour, new THREE.Color(colour));
  }
  return colours.get(colour);
}

/** Vertices with positions and colours; `Part` is a mesh, lines or points of three.js. */
class Batch {
  constructor(Part, material) {
    Object.assign(material, { vertexColors: true, transparent: true, depthWrite: false });
    this.object = new Part(new THREE.BufferGeometry(), material);
    this.object.frustumCulled = false;
    this._count = 0;
    this._reserve(1024);
  }

  _reserve(capacity) {
    const grown = (old, size) => {
      const array = new Float32Array(capacity * size);
      array.set(old ?? []);
      return array;
    };
    this._capacity = capacity;
    this._positions = grown(this._positions, 3);
    this._colours = grown(this._colours, 4);
    this._isNew = true;
  }

  _vertex(x, y, z, colour, alpha) {
    if (this._count === this._capacity) {
      this._reserve(2 * this._capacity);
    }
    this._positions.set([x, y, z], 3 * this._count);
    this._colours.set([colour.r, colour.g, colour.b, alpha], 4 * this._count);
    this._count += 1;
  }

  /** Forget all vertices. */
  clear() {
    this._count = 0;
  }

  /** Hand the vertices to the graphics card. */
  finish() {
    const { geometry } = this.object;
    if (this._isNew) {
      geometry.dispose();
      const attribute = (array, size) =>
        new THREE.BufferAttribute(array, size).setUsage(THREE.DynamicDrawUsage);
      geometry.setAttribute("position", attribute(this._positions, 3));
      geometry.setAttribute("color", attribute(this._colours, 4));
      this._isNew = false;
    }
    for (const attribute of Object.values(geometry.attributes)) {
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, this._count * attribute.itemSize);
      attribute.needsUpdate = true;
    }
    geometry.setDrawRange(0, this._count);
  }
}

/** Flat bands along lines at one height. */
export class Ribbons extends Batch {
  constructor() {
    super(THREE.Mesh, new THREE.MeshBasicMaterial({ side: THREE.DoubleSide }));
    this.object.renderOrder = 2;
  }

  /** Add a band at a height, metres broad; a shade of 1 is the colour itself, 0 is black. */
  add({ points, width }, z, colour, alpha, breadth, shade = 1) {
    const ink = linear(colour).clone().multiplyScalar(shade);
    for (let i = width; i < points.length; i += width) {
      const [ax, ay] = [points[i - width], points[i - width + 1]];
      const [bx, by] = [points[i], points[i + 1]];
      const length = Math.hypot(bx - ax, by - ay);
      if (length > 0) {
        const nx = (-(by - ay) / length) * (breadth / 2);
        const ny = ((bx - ax) / length) * (breadth / 2);
        this._vertex(ax + nx, ay + ny, z, ink, alpha);
        this._vertex(ax - nx, ay - ny, z, ink, alpha);
        this._vertex(bx + nx, by + ny, z, ink, alpha);
        this._vertex(bx + nx, by + ny, z, ink, alpha);
        this._vertex(ax - nx, ay - ny, z, ink, alpha);
        this._vertex(bx - nx, by - ny, z, ink, alpha);
      }
    }
  }
}

/** Lines of one pixel. */
export class Lines extends Batch {
  constructor() {
    super(THREE.LineSegments, new THREE.LineBasicMaterial());
  }

  /** Add a line between two points. */
  add(ax, ay, az, bx, by, bz, colour) {
    const ink = linear(colour);
    this._vertex(ax, ay, az, ink, 0.5);
    this._vertex(bx, by, bz, ink, 0.5);
  }

  /** Add a closed line at one height. */
  addLoop({ points, width }, z, colour) {
    for (let i = 0; i < points.length; i += width) {
      const next = (i + width) % points.length;
      this.add(points[i], points[i + 1], z, points[next], points[next + 1], z, colour);
    }
  }
}

/** Points of a fixed size on the screen. */
export class Points extends Batch {
  /** @param {number} size Pixels. */
  constructor(size) {
    super(THREE.Points, new THREE.PointsMaterial({ size, sizeAttenuation: false }));
  }

  /** Show the points of scans. */
  update(scans) {
    this.clear();
    for (const { points, width, colour } of scans) {
      const ink = linear(colour);
      for (let i = 0; i < points.length; i += width) {
        this._vertex(points[i], points[i + 1], points[i + 2], ink, 1);
      }
    }
    this.finish();
  }
}
