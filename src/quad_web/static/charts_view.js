/**
 * Charts of the last minute, drawn with the ECharts that NiceGUI brings along.
 */

import { FEW_ROBOTS, layoutOptions, seriesOptions } from "./chart_options.js";
import { INK } from "./colours.js";
import { make, say } from "./dom.js";
import { sharedLink } from "./link.js";
import { SampleHistory } from "./samples.js";

const PERIOD_MS = 500;
const FULL_SPEED_PERIOD_MS = 1000; // the flight needs the processor
const STILL_FRAMES = 1; // after which ECharts stops to ask the browser for frames

/** The charts in an element of the page. */
export class ChartsView {
  /**
   * @param {HTMLElement} root
   * @param {object} echarts The library.
   */
  constructor(root, echarts) {
    this._root = root;
    this._history = new SampleHistory();
    this._selected = null;
    this._revision = 0;
    this._hasNews = false;
    this._key = make("div", { class: "quad-charts-key" });
    this._plot = make("div", { class: "quad-charts-plot" });
    root.append(this._key, this._plot);
    this._link = sharedLink();
    this._chart = echarts.init(this._plot, null, { renderer: "canvas" });
    this._chart.getZr().setSleepAfterStill(STILL_FRAMES);
    this._drawn_ms = 0;
    this._onFrame = () => this._read();
    this._link.addEventListener("frame", this._onFrame);
    this._timer = setInterval(() => this._drawIfDue(), PERIOD_MS);
    this._resizes = new ResizeObserver(() => this._resize());
    this._resizes.observe(this._plot);
  }

  /** Stop listening. */
  dispose() {
    clearInterval(this._timer);
    this._resizes.disconnect();
    this._link.removeEventListener("frame", this._onFrame);
    this._chart.dispose();
  }

  /** Draw one robot's lines bold; null: no robot. */
  select(robot) {
    this._selected = robot;
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
    return !document.hidden && this._plot.clientWidth > 0 && this._plot.clientHeight > 0;
  }

  _resize() {
    if (this._isSeen) {
      const { clientWidth, clientHeight } = this._plot;
      this._chart.resize({ width: clientWidth, height: clientHeight });
      this._chart.setOption(layoutOptions(clientWidth, clientHeight));
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
    const colourOf = (robot) => colours[robot] ?? INK.limited;
    const series = seriesOptions(this._history, this._selected, colourOf);
    this._chart.setOption({ series }, { replaceMerge: ["series"] });
    this._writeKey(colourOf);
  }

  /** Say whose lines these are. */
  _writeKey(colourOf) {
    const { count } = this._history;
    const robots = count <= FEW_ROBOTS ? [...Array(count).keys()] : [];
    if (this._selected !== null && this._selected < count && !robots.includes(this._selected)) {
      robots.push(this._selected);
    }
    const state = JSON.stringify([count, robots, this._selected, robots.map(colourOf)]);
    if (state === this._keyState) {
      return;
    }
    this._keyState = state;
    const entry = (colour, className, text) => {
      const swatch = make("span", { class: className });
      swatch.style.background = colour;
      const label = make("span");
      say(label, text);
      return make("span", { class: "quad-charts-entry" }, swatch, label);
    };
    const line = (robot) =>
      entry(
        colourOf(robot),
        robot === this._selected ? "quad-line quad-line-bold" : "quad-line",
        `robot ${robot}`,
      );
    const range = `all ${count}: least to greatest`;
    const band = count > FEW_ROBOTS ? [entry("#b9c2cc", "quad-band", range)] : [];
    this._key.replaceChildren(...robots.map(line), ...band);
  }
}
