/**
 * Mouse, touch and pen on the arena: what is a click, a drag, a pinch and a long press.
 *
 * A tool may claim a drag when it begins; other drags move the view. Two fingers always move and
 * zoom the view.
 *
 * @typedef {{px: number, py: number, x: number, y: number, isTouch: boolean}} Place Pixels, and
 *   metres in the arena.
 * @typedef {object} Tool
 * @property {(place: Place) => void} tap A click.
 * @property {(place: Place) => boolean} press A drag begins; true claims it.
 * @property {(place: Place) => void} drag The claimed drag goes on.
 * @property {(place: Place) => void} release The claimed drag ends.
 * @property {() => void} cancel The claimed drag is given up.
 * @property {(place: Place) => void} hold A long press, or the right mouse button.
 * @property {boolean} holds Whether a long press means something else than a drag.
 */

const SLOP_PX = 4;
const TOUCH_SLOP_PX = 9;
const HOLD_MS = 550;
const WHEEL_FACTOR = 0.0015; // of the logarithm of the scale, for each pixel of the wheel

/** Watches an element, drives the tool, and moves the view. */
export class Gestures {
  /** The host has `tool()`, `view()`, `moved()` when the view has, and `hovered(place)`. */
  constructor(element, host) {
    this._element = element;
    this._host = host;
    this._pointers = new Map();
    this._drag = null; // "tool", "view", or null before the pointer has moved
    this._holdTimer = null;
    const on = (name, handler, options) => element.addEventListener(name, handler, options);
    on("pointerdown", (event) => this._down(event), { capture: true });
    on("pointermove", (event) => this._move(event), { capture: true });
    on("pointerup", (event) => this._up(event), { capture: true });
    on("pointercancel", () => this.cancel(), { capture: true });
    on("pointerleave", () => host.hovered(null));
    on("contextmenu", (event) => {
      event.preventDefault();
      if (event.pointerType !== "touch" && !this._drag && !this._hasMoved) {
        host.tool().hold(this._place(event));
      }
    });
    on("wheel", (event) => this._wheel(event), { passive: false });
  }

  /** Give up what is going on. */
  cancel() {
    clearTimeout(this._holdTimer);
    if (this._drag === "tool") {
      this._host.tool().cancel();
    }
    this._drag = null;
    this._pointers.clear();
    this._host.view().setBusy?.(false);
  }

  _place(event) {
    const box = this._element.getBoundingClientRect();
    const [px, py] = [event.clientX - box.left, event.clientY - box.top];
    const [x, y] = this._host.view().toWorld(px, py) ?? [NaN, NaN];
    return { px, py, x, y, isTouch: event.pointerType === "touch" };
  }

  _down(event) {
    const place = this._place(event);
    this._pointers.set(event.pointerId, place);
    if (this._pointers.size === 2) {
      clearTimeout(this._holdTimer);
      if (this._drag === "tool") {
        this._host.tool().cancel();
        this._host.view().setBusy?.(false);
      }
      this._drag = "view";
    }
    if (this._pointers.size > 1) {
      return;
    }
    this._start = place;
    this._hasMoved = false;
    this._drag = null;
    this._button = event.button;
    if (event.button === 0 && this._host.tool().press(place)) {
      this._drag = "tool";
      this._host.view().setBusy?.(true); // before the view sees the event
    }
    if (!this._host.view().ownsGestures || this._drag === "tool") {
      this._element.setPointerCapture(event.pointerId);
    }
    if (place.isTouch) {
      this._holdTimer = setTimeout(() => this._hold(place), HOLD_MS);
    }
  }

  _hold(place) {
    if (this._drag !== "view" && this._host.tool().holds) {
      this.cancel();
      this._host.tool().hold(place);
    }
  }

  _move(event) {
    const place = this._place(event);
    const before = this._pointers.get(event.pointerId);
    this._host.hovered(place);
    if (!before) {
      return;
    }
    const slop = place.isTouch ? TOUCH_SLOP_PX : SLOP_PX;
    const distance = Math.hypot(place.px - this._start.px, place.py - this._start.py);
    if (distance > slop) {
      clearTimeout(this._holdTimer);
      this._hasMoved = true;
      this._drag ??= "view";
    }
    if (this._drag === "tool") {
      this._pointers.set(event.pointerId, place);
      this._host.tool().drag(place);
    } else if (this._drag === "view") {
      this._moveView(event.pointerId, before, place);
    }
  }

  _moveView(id, before, place) {
    const view = this._host.view();
    const other = [...this._pointers].find(([key]) => key !== id)?.[1];
    this._pointers.set(id, place);
    if (view.ownsGestures) {
      return;
    }
    if (other) {
      const spread = (point) => Math.hypot(point.px - other.px, point.py - other.py);
      const middle = [(place.px + other.px) / 2, (place.py + other.py) / 2];
      view.panBy((place.px - before.px) / 2, (place.py - before.py) / 2);
      view.zoomAt(...middle, spread(place) / Math.max(spread(before), 1));
    } else {
      view.panBy(place.px - before.px, place.py - before.py);
    }
    this._host.moved();
  }

  _up(event) {
    clearTimeout(this._holdTimer);
    if (!this._pointers.delete(event.pointerId) || this._pointers.size) {
      return;
    }
    const place = this._place(event);
    const drag = this._drag;
    this._drag = null;
    if (drag === "tool") {
      this._host.tool().release(place);
      this._host.view().setBusy?.(false);
    } else if (drag === null && this._button === 0) {
      this._host.tool().tap(place);
    }
  }

  _wheel(event) {
    event.preventDefault();
    const view = this._host.view();
    if (!view.ownsGestures) {
      const pinch = event.ctrlKey ? 8 : 1; // of a touchpad, which counts in smaller steps
      const pixels = event.deltaY * (event.deltaMode === 1 ? 16 : 1) * pinch;
      const { px, py } = this._place(event);
      view.zoomAt(px, py, Math.exp(-WHEEL_FACTOR * pixels));
      this._host.moved();
    }
  }
}
