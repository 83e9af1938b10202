/**
 * Tool that edits the goals of a robot: drag a goal, drag its yaw handle, click to add one, and a
 * menu for the rest.
 */

import { INK, mix, textOn, withAlpha } from "./colours.js";
import { added, moved, removed, shifted, turned } from "./goal_list.js";
import { ahead, disc, drawArrow, drawDashes, tag, tagWidth, write } from "./map_marks.js";
import { ViewTool } from "./tools.js";
import { nearest } from "./viewport.js";

const RADIUS_PX = 12;
const HANDLE_PX = 40; // from the goal to its yaw handle
const TOUCH_REACH_PX = 22;
const STEP_M = 0.1;
const STEP_RAD = Math.PI / 12;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** Edits `arena.editing`, and reports each change with the event `edit`. */
export class EditTool extends ViewTool {
  constructor(arena) {
    super(arena);
    this._grabbed = null; // {index, part, before}
    this._current = -1;
  }

  get hint() {
    const robot = this._arena.editing?.robot;
    return (
      `Goals of robot ${robot}: drag one or its arrow, click to add one, ` +
      "right-click or hold one for more."
    );
  }

  get cursor() {
    return "crosshair";
  }

  get holds() {
    return true;
  }

  get _goals() {
    return this._arena.editing?.goals ?? [];
  }

  tap(place) {
    const found = this._find(place);
    if (found) {
      this._current = found.index;
      this._arena.requestDraw();
    } else if (this._arena.editing && Number.isFinite(place.x)) {
      this._current = this._goals.length;
      this._change(added(this._goals, place.x, place.y));
    }
  }

  press(place) {
    const found = this._find(place);
    if (!found) {
      return false;
    }
    const at = this._arena.view.toScreen(this._goals[found.index].x, this._goals[found.index].y);
    const offset = [at[0] - place.px, at[1] - place.py];
    this._current = found.index;
    this._grabbed = { ...found, before: this._goals, offset };
    this._arena.requestDraw();
    return true;
  }

  drag({ px, py, x, y }) {
    const { index, part, offset } = this._grabbed;
    const goal = this._goals[index];
    if (part === "yaw") {
      this._arena.editing.goals = turned(this._goals, index, Math.atan2(y - goal.y, x - goal.x));
    } else {
      const place = this._arena.view.toWorld(px + offset[0], py + offset[1]);
      if (place) {
        this._arena.editing.goals = moved(this._goals, index, ...place);
      }
    }
    this._arena.requestDraw();
  }

  release() {
    const { before } = this._grabbed;
    this._grabbed = null;
    if (this._goals !== before) {
      this._change(this._goals);
    }
  }

  cancel() {
    if (this._grabbed) {
      this._arena.editing.goals = this._grabbed.before;
      this._grabbed = null;
      this._arena.requestDraw();
    }
  }

  hold(place) {
    const found = this._find(place);
    if (found) {
      this._current = found.index;
      this._arena.requestDraw();
      this._arena.showMenu(place, `Goal ${found.index + 1}`, this._menuOf(found.index));
    }
  }

  _menuOf(index) {
    const goals = this._goals;
    const goal = goals[index];
    const shift = (by) => {
      this._current = index + by;
      this._change(shifted(goals, index, by));
    };
    return [
      ["Delete", () => this._delete(index), true],
      ["Any yaw", () => this._change(turned(goals, index, null)), goal.yaw !== null],
      ["Earlier", () => shift(-1), index > 0],
      ["Later", () => shift(1), index < goals.length - 1],
    ];
  }

  /** Keys of the current goal: arrows move it, with shift they turn it, Delete deletes it. */
  key(event) {
    const goal = this._goals[this._current];
    const arrow = ARROWS[event.key];
    if (!goal) {
      return false;
    }
    if (event.key === "Delete" || event.key === "Backspace") {
      this._delete(this._current);
    } else if (arrow && event.shiftKey) {
      const yaw = (goal.yaw ?? 0) - (arrow[0] || -arrow[1]) * STEP_RAD;
      this._change(turned(this._goals, this._current, yaw));
    } else if (arrow) {
      const [x, y] = [goal.x + arrow[0] * STEP_M, goal.y + arrow[1] * STEP_M];
      this._change(moved(this._goals, this._current, x, y));
    } else {
      return false;
    }
    return true;
  }

  _delete(index) {
    this._current = -1;
    this._change(removed(this._goals, index));
  }

  _change(goals) {
    const { editing } = this._arena;
    editing.goals = goals;
    editing.faults = []; // the server checks again
    this._arena.emit("edit", goals);
    this._arena.requestDraw();
  }

  /** Return the goal or the yaw handle at a place: `{index, part: "goal" | "yaw"}`, or null. */
  _find(place) {
    const { view } = this._arena;
    const reach = () => (place.isTouch ? TOUCH_REACH_PX : RADIUS_PX + 3);
    const centres = this._goals.map(({ x, y }) => view.toScreen(x, y));
    const goal = nearest(centres, place.px, place.py, reach);
    if (goal >= 0) {
      return { index: goal, part: "goal" };
    }
    const handles = this._goals.map((each) => handleOf(view, each));
    const handle = nearest(handles, place.px, place.py, reach);
    return handle >= 0 ? { index: handle, part: "yaw" } : null;
  }

  draw(context, view) {
    const { editing, fleet } = this._arena;
    if (!editing) {
      return;
    }
    const colour = fleet.editing?.colour ?? INK.accent;
    const places = editing.goals.map(({ x, y }) => view.toScreen(x, y));
    drawDashes(context, places, [2, 5], colour, 2);
    editing.goals.forEach((goal, i) => {
      const look = { colour, isCurrent: i === this._current, fault: editing.faults[i] ?? "" };
      drawEdited(context, view, goal, i, places[i], look);
    });
    editing.goals.forEach((_, i) => drawFault(context, view, fleet, places[i], editing.faults[i]));
  }
}

const handleOf = (view, goal) => ahead((x, y) => view.toScreen(x, y), goal, HANDLE_PX);

function drawEdited(context, view, goal, index, at, { colour, isCurrent, fault }) {
  const ink = fault ? INK.fault : colour;
  const handle = handleOf(view, goal);
  if (goal.yaw === null) {
    disc(context, ...handle, 5, INK.plate, withAlpha(ink, 0.45), 1.5);
  } else {
    drawArrow(context, at, handle, ink, 2.5);
  }
  if (isCurrent) {
    disc(context, ...at, RADIUS_PX + 5, withAlpha(INK.accent, 0.2), INK.accent, 2);
  }
  disc(context, ...at, RADIUS_PX, fault ? INK.fault : INK.plate, ink, 3);
  const text = fault ? textOn(INK.fault) : mix(colour, INK.strong, 0.4);
  write(context, String(index + 1), ...at, 12, text);
}

/** Write a fault beside its goal, within the picture, where it covers no robot. */
function drawFault(context, view, fleet, [px, py], fault) {
  if (!fault) {
    return;
  }
  const half = tagWidth(context, fault) / 2;
  const most = context.canvas.clientWidth - half - 4;
  const aside = half + RADIUS_PX + 6;
  const robots = fleet.robots.map((robot) => [
    ...view.toScreen(robot.x, robot.y, robot.z),
    view.reachOf(robot),
  ]);
  const places = [[0, 26], [0, -26], [aside, 0], [-aside, 0], [0, 44], [0, -44]].map(
    ([dx, dy]) => [Math.max(half + 4, Math.min(px + dx, most)), py + dy],
  );
  const isFree = ([x, y]) =>
    robots.every(([rx, ry, r]) => Math.abs(rx - x) > half + r || Math.abs(ry - y) > 8 + r);
  tag(context, fault, ...(places.find(isFree) ?? places[0]), INK.fault);
}
