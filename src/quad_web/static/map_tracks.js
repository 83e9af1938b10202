/**
 * Map view: tracks and suspects. A ring has the colour of the robot that tracks the obstacle.
 */

import { INK, withAlpha } from "./colours.js";

/** Seconds after which a tracked obstacle is at the end of its line. */
const AHEAD_S = 1;
/** Slower ones have no line. */
const SLOWEST_MPS = 0.05;

/** Opacities of fill and ring, and dashes, by kind. */
const LOOKS = {
  seen: { fill: withAlpha(INK.tracked, 0.3), ring: 1, dash: [] },
  hidden: { fill: withAlpha(INK.tracked, 0.12), ring: 0.6, dash: [5, 4] },
  suspect: { fill: withAlpha(INK.suspect, 0.35), ring: 0.7, dash: [1.5, 3] },
};

/** Return the line from a tracked obstacle to where it will be, null for what stands. */
export function lineAhead({ x, y, vx, vy }) {
  const isSlow = Math.hypot(vx, vy) < SLOWEST_MPS;
  return isSlow ? null : [[x, y], [x + AHEAD_S * vx, y + AHEAD_S * vy]];
}

/**
 * Draw tracks and suspects.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {import("./viewport.js").Viewport} viewport
 * @param {object[]} tracks As in `fleet.js`.
 */
export function drawTracks(context, viewport, tracks) {
  for (const track of tracks) {
    const { fill, ring, dash } = LOOKS[track.kind];
    context.beginPath();
    const [px, py] = viewport.toScreen(track.x, track.y);
    context.arc(px, py, track.radius * viewport.scale, 0, 2 * Math.PI);
    context.fillStyle = fill;
    context.fill();
    context.setLineDash(dash);
    context.lineWidth = 2;
    context.strokeStyle = withAlpha(track.colour, ring);
    context.stroke();
    context.setLineDash([]);
    const ahead = lineAhead(track);
    if (ahead) {
      context.beginPath();
      context.moveTo(...viewport.toScreen(...ahead[0]));
      context.lineTo(...viewport.toScreen(...ahead[1]));
      context.stroke();
    }
  }
}
