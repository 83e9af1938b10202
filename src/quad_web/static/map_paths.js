/**
 * Map view: cells, trails, plans and LIDAR points.
 */

import { INK, mix, withAlpha } from "./colours.js";

const MOST_POINTS = 12000; // of all LIDARs together; beyond, every second, third, ... is drawn

/** Draw the Voronoi cells that commands are limited to. */
export function drawCells(context, viewport, cells) {
  context.setLineDash([5, 4]);
  context.lineWidth = 1;
  for (const { points, width, colour } of cells) {
    trace(context, viewport, points, width);
    context.closePath();
    context.fillStyle = withAlpha(colour, 0.06);
    context.fill();
    context.strokeStyle = withAlpha(colour, 0.55);
    context.stroke();
  }
  context.setLineDash([]);
}

/** Draw trails, and the plans of each robot over them. */
export function drawPaths(context, viewport, { trails, plans, localPlans, selected }) {
  context.lineCap = "round";
  context.lineJoin = "round";
  const isFaded = (path) => selected && path.robot !== selected.index;
  for (const path of trails) {
    line(context, viewport, path, withAlpha(path.colour, isFaded(path) ? 0.25 : 0.45), 1.5);
  }
  for (const path of plans) {
    line(context, viewport, path, withAlpha(path.colour, isFaded(path) ? 0.55 : 1), 2);
  }
  for (const path of localPlans) {
    const dark = mix(path.colour, INK.strong, 0.45);
    line(context, viewport, path, withAlpha(dark, isFaded(path) ? 0.6 : 1), 3.5);
  }
}

/** Draw LIDAR points in the colours of their robots. */
export function drawScans(context, viewport, scans) {
  const total = scans.reduce((sum, { points, width }) => sum + points.length / width, 0);
  const every = Math.max(1, Math.ceil(total / MOST_POINTS));
  const side = viewport.scale > 60 ? 3 : 2;
  for (const { points, width, colour } of scans) {
    context.fillStyle = colour;
    for (let i = 0; i < points.length; i += every * width) {
      const px = viewport.width / 2 + (points[i] - viewport.x) * viewport.scale;
      const py = viewport.height / 2 - (points[i + 1] - viewport.y) * viewport.scale;
      context.fillRect(px - side / 2, py - side / 2, side, side);
    }
  }
}

function line(context, viewport, { points, width }, colour, thickness) {
  if (points.length < 2 * width) {
    return;
  }
  trace(context, viewport, points, width);
  context.lineWidth = thickness;
  context.strokeStyle = colour;
  context.stroke();
}

function trace(context, viewport, points, width) {
  context.beginPath();
  for (let i = 0; i < points.length; i += width) {
    const px = viewport.width / 2 + (points[i] - viewport.x) * viewport.scale;
    const py = viewport.height / 2 - (points[i + 1] - viewport.y) * viewport.scale;
    i ? context.lineTo(px, py) : context.moveTo(px, py);
  }
}
