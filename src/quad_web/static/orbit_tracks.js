/**
 * View in space: tracks and suspects, as rings at the flying altitude.
 */

import { INK } from "./colours.js";
import { lineAhead } from "./map_tracks.js";

const CORNERS = 24;

/** Opacities of rings by kind. */
const ALPHAS = { seen: 1, hidden: 0.4, suspect: 0.9 };

/**
 * Add the rings and lines of tracks and suspects; those of suspects are yellow.
 *
 * @param {import("./orbit_batches.js").Ribbons} ribbons
 * @param {object[]} tracks As in `fleet.js`.
 * @param {number} z Height, m.
 * @param {number} breadth Metres.
 */
export function addTracks(ribbons, tracks, z, breadth) {
  for (const track of tracks) {
    const colour = track.kind === "suspect" ? INK.suspect : track.colour;
    const ring = { points: ringOf(track), width: 2 };
    ribbons.add(ring, z, colour, ALPHAS[track.kind], breadth);
    const ahead = lineAhead(track);
    if (ahead) {
      ribbons.add({ points: ahead.flat(), width: 2 }, z, colour, ALPHAS[track.kind], breadth);
    }
  }
}

/** Return a closed polygon, x and y of its corners. */
function ringOf({ x, y, radius }) {
  return Array.from({ length: CORNERS + 1 }, (_, i) => {
    const angle = (2 * Math.PI * i) / CORNERS;
    return [x + radius * Math.cos(angle), y + radius * Math.sin(angle)];
  }).flat();
}
