/**
 * Tools of the pointer: look at the fleet, send a goal, and tell a pose. `edit_tool.js` has another
 * one.
 */

import { INK } from "./colours.js";
import { disc, drawArrow, tag } from "./map_marks.js";
import { nearest } from "./viewport.js";

const MOUSE_REACH_PX = 12;
const TOUCH_REACH_PX = 24;
const YAW_FROM_PX = 14; // shorter drags give no yaw

/** Return the index of the robot at a place, null if there is none. */
export function robotAt(view, robots, place) {
  const least = place.isTouch ? TOUCH_REACH_PX : MOUSE_REACH_PX;
  const points = robots.map((robot) => view.toScreen(robot.x, robot.y, robot.z));
  const reach = (i) => Math.max(view.reachOf(robots[i]), least);
  const found = nearest(points, place.px, place.py, reach);
  return found < 0 ? null : robots[found].index;
}

/** Selects robots. */
export class ViewTool {
  /** @param {object} arena The arena, see `arena_view.js`. */
  constructor(arena) {
    this._arena = arena;
  }

  /** What the person can do, one sentence. */
  get hint() {
    return "";
  }

  /** CSS cursor. */
  get cursor() {
    return "grab";
  }

  /** Whether a long press means something else than a drag. */
  get holds() {
    return false;
  }

  tap(place) {
    const { view, fleet } = this._arena;
    this._arena.pick(robotAt(view, fleet.robots, place));
  }

  press() {
    return false;
  }

  drag() {}

  release() {}

  cancel() {}

  hold() {}

  key() {
    return false;
  }

  draw() {}
}

/** Sends a goal: press where it is, and drag to where the robot shall look. */
export class GoalTool extends ViewTool {
  constructor(arena) {
    super(arena);
    this._goal = null;
    this._event = "goal";
  }

  get hint() {
    const robot = this._arena.fleet.selected;
    const who = robot ? `robot ${robot.index}` : "the nearest robot";
    return `Press where ${who} shall fly, and drag to turn it.`;
  }

  get cursor() {
    return "crosshair";
  }

  tap() {}

  press({ x, y, px, py }) {
    if (!Number.isFinite(x)) {
      return false;
    }
    this._goal = { x, y, px, py, yaw: null };
    this._arena.requestDraw();
    return true;
  }

  drag({ x, y, px, py }) {
    const goal = this._goal;
    const isFar = Math.hypot(px - goal.px, py - goal.py) > YAW_FROM_PX && Number.isFinite(x);
    goal.yaw = isFar ? Math.atan2(y - goal.y, x - goal.x) : null;
    this._arena.requestDraw();
  }

  release(place) {
    this.drag(place);
    const { x, y, yaw } = this._goal;
    this._goal = null;
    this._arena.emit(this._event, { x, y, yaw });
    this._arena.requestDraw();
  }

  cancel() {
    this._goal = null;
    this._arena.requestDraw();
  }

  draw(context, view) {
    const goal = this._goal;
    if (!goal) {
      return;
    }
    const at = view.toScreen(goal.x, goal.y);
    const colour = this._arena.fleet.selected?.colour ?? INK.accent;
    if (goal.yaw !== null) {
      const ahead = 60 * view.metresPerPixel;
      const tip = [goal.x + ahead * Math.cos(goal.yaw), goal.y + ahead * Math.sin(goal.yaw)];
      drawArrow(context, at, view.toScreen(...tip), colour, 4);
    }
    disc(context, ...at, 9, INK.plate, colour, 4);
    const degrees = goal.yaw === null ? "" : `, ${Math.round((goal.yaw * 180) / Math.PI)}°`;
    const text = `${goal.x.toFixed(2)}, ${goal.y.toFixed(2)} m${degrees}`;
    tag(context, text, at[0], at[1] + 24, INK.text);
  }
}

/** Tells the selected robot where it is: press there, and drag to where it looks. */
export class PoseTool extends GoalTool {
  constructor(arena) {
    super(arena);
    this._event = "pose";
  }

  get hint() {
    const robot = this._arena.fleet.selected;
    return robot
      ? `Press where robot ${robot.index} is, and drag to where it looks.`
      : "Click the robot whose pose you know.";
  }

  tap(place) {
    ViewTool.prototype.tap.call(this, place);
  }

  press(place) {
    return this._arena.fleet.selected !== null && super.press(place);
  }
}
