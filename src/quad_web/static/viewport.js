/**
 * Projection of the map view: metres in `map` (x right, y up) to CSS pixels (y down).
 */

/** Pixels of what the view cannot show. */
export const OUTSIDE = [-1e4, -1e4];

/** Trace a line through places in pixels; those outside interrupt it. */
export function tracePath(context, places) {
  context.beginPath();
  places.forEach((place, i) => {
    const isSeen = i > 0 && place !== OUTSIDE && places[i - 1] !== OUTSIDE;
    isSeen ? context.lineTo(...place) : context.moveTo(...place);
  });
}

const LEAST_SCALE = 1; // pixels per metre
const GREATEST_SCALE = 2000;

/** The part of the arena that the map view shows. */
export class Viewport {
  constructor() {
    this.width = 1;
    this.height = 1;
    this.scale = 50; // pixels per metre
    this.x = 0; // centre, m
    this.y = 0;
  }

  /** Return pixels of a point in metres. */
  toScreen(x, y) {
    return [
      this.width / 2 + (x - this.x) * this.scale,
      this.height / 2 - (y - this.y) * this.scale,
    ];
  }

  /** Return metres of a point in pixels. */
  toWorld(px, py) {
    return [
      this.x + (px - this.width / 2) / this.scale,
      this.y - (py - this.height / 2) / this.scale,
    ];
  }

  /** Move the content by pixels. */
  panBy(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
  }

  /** Zoom about a pixel, which keeps its place in the arena. */
  zoomAt(px, py, factor) {
    const [x, y] = this.toWorld(px, py);
    this.scale = Math.min(GREATEST_SCALE, Math.max(LEAST_SCALE, this.scale * factor));
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
  }

  /** Show a rectangle in metres as large as it fits; insets are pixels that stay free. */
  fit(bounds, { left, right, top, bottom }) {
    this.scale = Math.min(
      Math.max(this.width - left - right, 10) / Math.max(bounds.maxX - bounds.minX, 0.1),
      Math.max(this.height - top - bottom, 10) / Math.max(bounds.maxY - bounds.minY, 0.1),
    );
    this.x = (bounds.minX + bounds.maxX) / 2 - (left - right) / 2 / this.scale;
    this.y = (bounds.minY + bounds.maxY) / 2 + (top - bottom) / 2 / this.scale;
  }
}

/** Return the longest of 1, 2 and 5 times a power of ten that is not longer than a length. */
export function roundLength(longest) {
  const power = 10 ** Math.floor(Math.log10(longest));
  const digit = longest / power;
  return power * (digit >= 5 ? 5 : digit >= 2 ? 2 : 1);
}

/** Return a length with its unit, such as `50 cm` or `2 m`. */
export function formatLength(metres) {
  return metres < 1 ? `${Math.round(metres * 100)} cm` : `${Math.round(metres)} m`;
}

/** Return the index of the nearest point within the reach of each, in pixels; -1 without one. */
export function nearest(points, px, py, reach) {
  let best = -1;
  let least = Infinity;
  points.forEach((point, index) => {
    const distance = Math.hypot(point[0] - px, point[1] - py);
    if (distance <= reach(index) && distance < least) {
      best = index;
      least = distance;
    }
  });
  return best;
}

/** Return an angle in (-pi, pi]. */
export function wrapAngle(angle) {
  const turned = Math.atan2(Math.sin(angle), Math.cos(angle));
  return turned === -Math.PI ? Math.PI : turned;
}
