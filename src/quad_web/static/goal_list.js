/**
 * Goals while they are edited: lists that are never changed, only replaced.
 *
 * @typedef {{source: ?number, x: number, y: number, yaw: ?number}} Goal `source` is the goal's
 *   number in its file, null for a new one.
 */

import { wrapAngle } from "./viewport.js";

const round = (value) => Math.round(value * 1000) / 1000; // millimetres and milliradians

/** Return the goals with one of them at another place. */
export function moved(goals, index, x, y) {
  return replaced(goals, index, { x: round(x), y: round(y) });
}

/** Return the goals with another yaw for one of them; null is any yaw. */
export function turned(goals, index, yaw) {
  return replaced(goals, index, { yaw: yaw === null ? null : round(wrapAngle(yaw)) });
}

/** Return the goals and a new one, by default at the end. */
export function added(goals, x, y, index = goals.length) {
  const goal = { source: null, x: round(x), y: round(y), yaw: null };
  return [...goals.slice(0, index), goal, ...goals.slice(index)];
}

/** Return the goals without one of them. */
export function removed(goals, index) {
  return goals.filter((_, i) => i !== index);
}

/** Return the goals with one of them earlier (-1) or later (1) in their order. */
export function shifted(goals, index, by) {
  const target = index + by;
  if (target < 0 || target >= goals.length) {
    return goals;
  }
  const others = removed(goals, index);
  return [...others.slice(0, target), goals[index], ...others.slice(target)];
}

function replaced(goals, index, changes) {
  return goals.map((goal, i) => (i === index ? { ...goal, ...changes } : goal));
}
