/**
 * The arena: joins the link, the views, the tools and what lies over them.
 */

import { inkChanges } from "./colours.js";
import { EditTool } from "./edit_tool.js";
import {
  boundsOf,
  fleetOf,
  LARGE_FLEET,
  OF_ONE_ROBOT,
  solidAt,
  STREAMED_LAYERS,
} from "./fleet.js";
import { Gestures } from "./gestures.js";
import { Hud, LinkNotice } from "./hud.js";
import { make, say } from "./dom.js";
import { sharedLink } from "./link.js";
import { MapView } from "./map_view.js";
import { GoalTool, PoseTool, ViewTool } from "./tools.js";

const PAN_PX = 60;
const PANS = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** The arena in an element of the page. */
export class View {
  /** `emit` tells Python: select, goal, pose, edit, tool, mode, follow. */
  constructor(root, emit) {
    this.emit = emit;
    this.editing = null;
    this._root = root;
    this._choices = { selected: null, layers: new Set(), editing: null };
    this._role = "watch";
    this._isFollowing = false;
    this._isFitted = false;
    this._tools = {
      view: new ViewTool(this),
      goal: new GoalTool(this),
      pose: new PoseTool(this),
      edit: new EditTool(this),
    };
    this._tool = "view";
    this._mode = "2d";
    this._map = make("canvas", { class: "quad-map" });
    this._overlay = make("canvas", { class: "quad-overlay" });
    root.append(this._map, this._overlay);
    this.view = new MapView(this._map);
    this._views = { "2d": this.view };
    this._link = sharedLink();
    this._robotCount = 0;
    this._readFleet();
    this._hud = new Hud(root, {
      fit: () => this._fit(),
      zoom: (factor) => this._zoom(factor),
      follow: () => this._setFollowing(!this._isFollowing),
      leave: () => this._leaveTool(),
      covered: () => this._resize(),
    });
    this._notice = new LinkNotice(this._link);
    this._listen();
  }

  _listen() {
    this._gestures = new Gestures(this._overlay, {
      tool: () => this._tools[this._tool],
      view: () => this.view,
      moved: () => this._moved(),
      hovered: (place) => this._hovered(place),
    });
    this._overlay.addEventListener("pointerdown", () => this._hud.hideMenu());
    this._root.addEventListener("keydown", (event) => this._key(event));
    this._onEscape = (event) => {
      if (event.key === "Escape" && this._tool !== "view") {
        event.stopPropagation();
        this._hud.hideMenu() || this._leaveTool();
      }
    };
    document.addEventListener("keydown", this._onEscape, { capture: true });
    this._onFrame = () => this._draw();
    this._link.addEventListener("frame", this._onFrame);
    this._onVisible = () => this.requestDraw();
    document.addEventListener("visibilitychange", this._onVisible);
    this._onInk = () => this._changeInk();
    inkChanges.addEventListener("change", this._onInk);
    this._resizes = new ResizeObserver(() => this._resize());
    this._resizes.observe(this._root);
  }

  /** Stop listening. */
  dispose() {
    this._notice.dispose();
    this._resizes.disconnect();
    inkChanges.removeEventListener("change", this._onInk);
    document.removeEventListener("keydown", this._onEscape, { capture: true });
    document.removeEventListener("visibilitychange", this._onVisible);
    this._link.removeEventListener("frame", this._onFrame);
    for (const view of Object.values(this._views)) {
      view.dispose?.();
    }
  }

  /** Take over what Python has set, see class `Arena` in `arena.py`. */
  apply(state) {
    if (state.role !== undefined) {
      this._role = state.role;
    }
    if (state.layers !== undefined) {
      this._explainCostmaps(state.layers);
      this._choices.layers = new Set(state.layers);
      this._hud.legend.clear();
    }
    if (state.selected !== undefined) {
      this._choices.selected = state.selected;
      this._hud.note("");
    }
    if (state.editing !== undefined) {
      this.editing = state.editing && { faults: [], ...state.editing };
    }
    if (state.tool !== undefined) {
      this._setTool(this._role === "steer" && this._tools[state.tool] ? state.tool : "view");
    }
    if (["2d", "3d"].includes(state.mode) && state.mode !== this._mode) {
      this._setMode(state.mode);
    }
    if (state.following !== undefined) {
      this._isFollowing = state.following && !this._showsAll();
    }
    this._want();
    this.requestDraw();
  }

  /** Say why nothing is seen of a costmap that was switched on. */
  _explainCostmaps(layers) {
    const isNew = (layer) => layers.includes(layer) && !this._choices.layers.has(layer);
    if (this._choices.selected === null && OF_ONE_ROBOT.some(isNew)) {
      this._hud.note("Costmaps are those of the selected robot: click one.");
    }
  }

  /** Return whether the whole arena is seen, so that there is nothing to follow. */
  _showsAll() {
    const { minX, minY, maxX, maxY } = boundsOf(this.fleet);
    const corners = [[minX, minY], [minX, maxY], [maxX, minY], [maxX, maxY]];
    return corners.every(([x, y]) => {
      const [px, py] = this.view.toScreen(x, y, 0);
      return px >= 0 && py >= 0 && px <= this._root.clientWidth && py <= this._root.clientHeight;
    });
  }

  /** Select a robot (null: none) as the person has clicked it. */
  pick(robot) {
    if (robot !== this._choices.selected) {
      this._choices.selected = robot;
      this._want();
      this.emit("select", robot);
      this.requestDraw();
    }
  }

  /** Draw soon. */
  requestDraw() {
    if (!this._request) {
      this._request = requestAnimationFrame(() => {
        this._request = null;
        this._draw();
      });
    }
  }

  /** Show a menu; see `Hud.showMenu`. */
  showMenu(place, title, entries) {
    this._hud.showMenu(place, title, entries);
  }

  _want() {
    const { layers, selected } = this._choices;
    const streamed = STREAMED_LAYERS.filter((layer) => layers.has(layer));
    const isSmall = this._robotCount > 0 && this._robotCount <= LARGE_FLEET;
    this._link.want(streamed, selected, isSmall);
  }

  _setTool(tool) {
    if (tool !== this._tool) {
      this._gestures.cancel();
      this._hud.hideMenu();
      this._tool = tool;
    }
    this._overlay.style.cursor = this._tools[tool].cursor;
  }

  _leaveTool() {
    this._setTool("view");
    this.emit("tool", "view");
    this.requestDraw();
  }

  async _setMode(mode) {
    this._gestures.cancel();
    this._mode = mode;
    if (!this._views[mode]) {
      try {
        const { OrbitView } = await import("./orbit_view.js");
        this._views[mode] ??= new OrbitView(this._root, this._overlay, {
          moved: () => this._moved(),
          lost: () => this._fallBack("its graphics were reset"),
        });
      } catch (error) {
        this._fallBack(error.message);
        return;
      }
    }
    if (mode !== this._mode) {
      return; // it was changed again while the modules were loaded
    }
    for (const [name, view] of Object.entries(this._views)) {
      view.canvas.hidden = name !== this._mode;
      view.setActive?.(name === this._mode);
    }
    this.view = this._views[this._mode];
    this._hud.legend.clear();
    this._isFitted = false;
    this._resize();
  }

  /** Go back to the map, and say why. */
  _fallBack(reason) {
    this._hud.note(`3D is not possible in this browser: ${reason}. This is the map.`);
    this.emit("mode", "2d");
    this._setMode("2d");
  }

  _resize() {
    const { clientWidth, clientHeight } = this._root;
    if (!clientWidth || !clientHeight) {
      return;
    }
    const ratio = window.devicePixelRatio || 1;
    this.view.resize(clientWidth, clientHeight, ratio);
    this._overlay.width = Math.round(clientWidth * ratio);
    this._overlay.height = Math.round(clientHeight * ratio);
    this._ratio = ratio;
    if (!this._hasMoved) {
      this._isFitted = false;
    }
    this._draw();
  }

  /** Draw everything anew: the reader's colour scheme has changed. */
  _changeInk() {
    const { "2d": map, ...others } = this._views;
    Object.values(others).forEach((view) => view.dispose());
    this._views = { "2d": map };
    this._hud.legend.clear();
    this._setMode(this._mode);
  }

  get _isSeen() {
    return !document.hidden && this._root.clientWidth > 0 && this._root.clientHeight > 0;
  }

  _readFleet() {
    this.fleet = fleetOf(this._link.store, { ...this._choices, editing: this.editing });
  }

  _draw() {
    if (!this._isSeen) {
      return;
    }
    this._readFleet();
    const { fleet, view } = this;
    if (this._robotCount !== fleet.robots.length) {
      this._robotCount = fleet.robots.length;
      this._want();
    }
    this._hud.legend.update(fleet, this._mode === "2d");
    if (!this._isFitted && (fleet.scene || fleet.robots.length)) {
      view.fit(fleet, this._hud.covered);
      this._isFitted = true;
    }
    if (this._isFollowing && fleet.selected) {
      view.follow(fleet.selected);
    }
    const labels = this._choices.layers.has("labels");
    view.draw(fleet, { labels });
    this._drawOverlay(fleet, labels);
    this._hud.setScale(view.hasScale ? view.metresPerPixel : null);
    this._hud.setFollow(this._isFollowing, fleet.selected !== null);
    this._hud.setHint(this._tools[this._tool].hint);
  }

  _drawOverlay(fleet, labels) {
    const context = this._overlay.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    const isUsed = this._tool !== "view" || this.editing || this.view.drawLabels;
    if (isUsed || this._isOverlayUsed) {
      context.clearRect(0, 0, this._overlay.width, this._overlay.height);
    }
    this._isOverlayUsed = isUsed;
    context.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
    this.view.drawLabels?.(context, fleet, { labels });
    if (this.editing) {
      this._tools.edit.draw(context, this.view);
    }
    this._tools.goal.draw(context, this.view);
    this._tools.pose.draw(context, this.view);
  }

  _moved() {
    this._hasMoved = true;
    this._hud.hideMenu();
    this.requestDraw();
  }

  _fit() {
    this._hasMoved = false;
    this._isFitted = false;
    this._setFollowing(false);
  }

  _zoom(factor) {
    this.view.zoomAt(this._root.clientWidth / 2, this._root.clientHeight / 2, factor);
    this._moved();
  }

  _setFollowing(isFollowing) {
    this._isFollowing = isFollowing;
    this.emit("follow", isFollowing);
    this.requestDraw();
  }

  _hovered(place) {
    if (!place || !Number.isFinite(place.x)) {
      say(this._hud.place, "");
      return;
    }
    const solid = solidAt(this.fleet, place.x, place.y);
    const top = solid && solid.bottom + solid.height;
    const span = solid && `${solid.bottom.toFixed(1)} to ${top.toFixed(1)} m high`;
    const there = solid ? `  ${solid.name}, ${span}` : "";
    say(this._hud.place, `x ${place.x.toFixed(2)}  y ${place.y.toFixed(2)} m${there}`);
  }

  _key(event) {
    if (event.target !== this._root || event.ctrlKey || event.metaKey || event.altKey) {
      return;
    }
    if (this._tools[this._tool].key(event)) {
      event.preventDefault();
      return;
    }
    const actions = {
      "+": () => this._zoom(1.25),
      "=": () => this._zoom(1.25),
      "-": () => this._zoom(1 / 1.25),
      0: () => this._fit(),
      Home: () => this._fit(),
      Enter: () => this._setFollowing(!this._isFollowing),
      n: () => this._step(1),
      p: () => this._step(-1),
      Escape: () => this.pick(null),
    };
    if (PANS[event.key]) {
      this.view.panBy(PANS[event.key][0] * PAN_PX, PANS[event.key][1] * PAN_PX);
      this._moved();
    } else if (actions[event.key]) {
      actions[event.key]();
    } else {
      return;
    }
    event.preventDefault();
  }

  /** Select the next robot or the one before. */
  _step(by) {
    const numbers = this.fleet.robots.map(({ index }) => index);
    if (numbers.length) {
      const at = numbers.indexOf(this._choices.selected);
      const next = at < 0 ? (by > 0 ? 0 : -1) : at + by;
      this.pick(numbers[(next + numbers.length) % numbers.length]);
    }
  }
}
