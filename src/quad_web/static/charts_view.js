/**
 * Charts of the last minute, drawn with the ECharts that NiceGUI brings along.
 */

import "echarts";

import { INK, inkChanges, seen } from "./colours.js";
import { sharedLink } from "./link.js";
import { emptyOptions, layoutOptions, SampleHistory, seriesOptions } from "./samples.js";

const PERIOD_MS = 500;
const FULL_SPEED_PERIOD_MS = 1000; // the flight needs the processor
const STILL_FRAMES = 1; // after which ECharts stops to ask the browser for frames

/** The charts in an element of the page. */
export class View {
  /** @param {HTMLElement} root */
  constructor(root) {
    this._root = root;
    this._history = new SampleHistory();
    this._selected = null;
    this._revision = 0;
    this._hasNews = false;
    this._link = sharedLink();
    this._chart = window.echarts.init(root, null, { renderer: "canvas" });
    this._chart.getZr().setSleepAfterStill(STILL_FRAMES);
    this._drawn_ms = 0;
    this._onFrame = () => this._read();
    this._link.addEventListener("frame", this._onFrame);
    this._timer = setInterval(() => this._drawIfDue(), PERIOD_MS);
    this._onInk = () => this._resize();
    inkChanges.addEventListener("change", this._onInk);
    this._resizes = new ResizeObserver(this._onInk);
    this._resizes.observe(root);
  }

  /** Stop listening. */
  dispose() {
    clearInterval(this._timer);
    this._resizes.disconnect();
    inkChanges.removeEventListener("change", this._onInk);
    this._link.removeEventListener("frame", this._onFrame);
    this._chart.dispose();
  }

  /** Draw the lines of the selected robot bold; null: of no robot. */
  apply({ selected }) {
    this._selected = selected;
    this._hasNews = true;
    this._draw();
  }

  _read() {
    const item = this._link.store.get("samples");
    if (item && item.revision !== this._revision) {
      this._revision = item.revision;
      this._history.add(item);
      this._hasNews = true;
    }
  }

  get _isSeen() {
    return !document.hidden && this._root.clientWidth > 0 && this._root.clientHeight > 0;
  }

  _resize() {
    if (this._isSeen) {
      const { clientWidth: width, clientHeight: height } = this._root;
      this._chart.resize({ width, height });
      this._chart.setOption(layoutOptions(width, height));
      this._empty = "";
      this._hasNews = true;
      this._draw();
    }
  }

  _drawIfDue() {
    const isAtFullSpeed = this._link.store.get("flight")?.data.wanted_rate === 0;
    const period_ms = isAtFullSpeed ? FULL_SPEED_PERIOD_MS : PERIOD_MS;
    if (performance.now() - this._drawn_ms > period_ms - PERIOD_MS / 2) {
      this._draw();
    }
  }

  _draw() {
    if (!this._hasNews || !this._isSeen || !this._history.count) {
      return;
    }
    this._hasNews = false;
    this._drawn_ms = performance.now();
    const colours = this._link.store.get("robots")?.data.colours ?? [];
    const colourOf = (robot) => seen(colours[robot] ?? INK.limited);
    const series = seriesOptions(this._history, this._selected, colourOf);
    this._chart.setOption({ series }, { replaceMerge: ["series"] });
    const graphic = emptyOptions(this._history, this._link.store.get("flight")?.data.source);
    const empty = JSON.stringify(graphic);
    if (empty !== this._empty) {
      this._empty = empty;
      this._chart.setOption({ graphic });
    }
  }
}
