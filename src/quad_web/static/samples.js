/**
 * The last minute of the item `samples`, and the options of ECharts for its four charts.
 */

import { INK, withAlpha } from "./colours.js";

const SPAN_S = 60; // that is kept
const SPACING_S = 0.1; // samples that are closer are left out
const COLUMNS = 4;
const FOUR_COLUMNS_PX = 860;
const TWO_COLUMNS_PX = 340;
const LEGEND_PX = 20;
const FONT = "Roboto, system-ui, sans-serif";

/** Up to so many robots have a line each; a larger fleet has a band. */
const FEW_ROBOTS = 3;

/** Title with its unit, and factor to that unit, of each column of the samples. */
const CHARTS = [
  { title: "Gap to the nearest robot, m", factor: 1 },
  { title: "Clearance to obstacles, m", factor: 1 },
  { title: "Speed, m/s", factor: 1 },
  { title: "Control cycle, ms", factor: 1000 },
];

/** Gap, clearance, speed and control-cycle time of each robot, in the order of time. */
export class SampleHistory {
  constructor() {
    this._clear(0);
  }

  _clear(count) {
    this.times = [];
    this.count = count; // robots
    this._rows = [];
  }

  /** Append what an item brings: one sample, and those before it that are new, too. */
  add({ data, arrays }) {
    const { times, history, values } = arrays;
    const size = values.values.length;
    times?.values.forEach((time_s, i) => {
      this._append(time_s, history.values.subarray(i * size, (i + 1) * size));
    });
    this._append(data.time_s, values.values);
  }

  /** Append a sample. A robot more or less, or a time that goes back, begins anew. */
  _append(time_s, values) {
    const newest_s = this.times.at(-1) ?? -Infinity;
    if (values.length !== COLUMNS * this.count || time_s < newest_s) {
      this._clear(values.length / COLUMNS);
    } else if (time_s - newest_s < SPACING_S - 1e-6) {
      return;
    }
    this.times.push(time_s);
    this._rows.push(values);
    const old = this.times.findIndex((one) => one >= time_s - SPAN_S);
    this.times.splice(0, old);
    this._rows.splice(0, old);
  }

  /** Return one value of one robot over time; NaN where it is unknown. */
  line(robot, column) {
    return this._rows.map((row) => row[COLUMNS * robot + column]);
  }

  /** Return whether a value is known of no robot at any time. */
  isEmpty(column) {
    const isUnknown = (value, i) => i % COLUMNS !== column || Number.isNaN(value);
    return this._rows.every((row) => row.every(isUnknown));
  }

  /** Return the least and the greatest value of all robots over time; NaN where all are unknown. */
  band(column) {
    const least = [];
    const greatest = [];
    for (const row of this._rows) {
      let [low, high] = [Infinity, -Infinity];
      for (let i = column; i < row.length; i += COLUMNS) {
        low = row[i] < low ? row[i] : low;
        high = row[i] > high ? row[i] : high;
      }
      least.push(low <= high ? low : NaN);
      greatest.push(low <= high ? high : NaN);
    }
    return { least, greatest };
  }
}

/** Return legend, titles, grids and axes for a size in pixels. */
export function layoutOptions(width, height) {
  const columns = width >= FOUR_COLUMNS_PX ? 4 : width >= TWO_COLUMNS_PX ? 2 : 1;
  const cellWidth = width / columns;
  const cellHeight = (height - LEGEND_PX) / (CHARTS.length / columns);
  const corner = (i) => [
    (i % columns) * cellWidth,
    LEGEND_PX + Math.floor(i / columns) * cellHeight,
  ];
  const empty = { type: "text", z: 10, silent: true, invisible: true };
  const text = { fontFamily: FONT, fontSize: 11, color: INK.muted };
  const legendText = { ...text, fontSize: 12, color: INK.text };
  return {
    animation: false,
    textStyle: text,
    legend: {
      top: 2,
      left: 4,
      icon: "rect",
      itemHeight: 3,
      itemWidth: 20,
      selectedMode: false,
      textStyle: legendText,
    },
    title: CHARTS.map(({ title }, i) => ({
      text: title,
      left: corner(i)[0] + 8,
      top: corner(i)[1] + 2,
      textStyle: { ...legendText, fontWeight: 500 },
    })),
    grid: CHARTS.map((_, i) => ({
      left: corner(i)[0] + 36,
      top: corner(i)[1] + 24,
      width: Math.max(cellWidth - 50, 20),
      height: Math.max(cellHeight - 46, 20),
    })),
    graphic: CHARTS.map((_, i) => ({
      ...empty,
      id: `empty${i}`,
      left: corner(i)[0] + 44,
      top: corner(i)[1] + cellHeight / 2 - 8,
      style: { fill: INK.muted, font: `13px ${FONT}` },
    })),
    xAxis: CHARTS.map((_, i) => ({
      gridIndex: i,
      type: "value",
      min: -SPAN_S,
      max: 0,
      interval: cellWidth > 260 ? 10 : 20,
      axisLabel: { ...text, formatter: (value) => (value ? `${value} s` : "now") },
      splitLine: { show: false },
      axisLine: { onZero: false, lineStyle: { color: INK.gridStrong } },
    })),
    yAxis: CHARTS.map((_, i) => ({
      gridIndex: i,
      type: "value",
      min: ({ min }) => Math.min(0, min),
      minInterval: 0.01, // robots at rest differ by less
      splitNumber: 3,
      axisLabel: text,
      axisLine: { show: false, onZero: false },
      axisTick: { show: false },
      splitLine: { lineStyle: { color: INK.grid } },
    })),
  };
}

/** Return the texts in charts without a value, which `source` does not have. */
export function emptyOptions(history, source) {
  const text = source === "replay" ? "not recorded" : "not known";
  return CHARTS.map((_, i) => ({
    id: `empty${i}`,
    invisible: !history.isEmpty(i),
    style: { text },
  }));
}

/** Return the lines of all charts; that of the selected robot is bold, one over another dashed. */
export function seriesOptions(history, selected, colourOf) {
  const isFew = history.count <= FEW_ROBOTS;
  const robots = [...Array(history.count).keys()].filter((i) => isFew || i === selected);
  return CHARTS.flatMap(({ factor }, column) => {
    const place = { xAxisIndex: column, yAxisIndex: column, silent: true };
    const lines = robots.map((robot) => history.line(robot, column));
    const own = (robot, k) => {
      const isDashed = lines.slice(0, k).some((other) => areSame(other, lines[k]));
      return {
        ...place,
        type: "line",
        name: `robot ${robot}`,
        showSymbol: false,
        data: points(history.times, lines[k], factor),
        color: colourOf(robot),
        lineStyle: { width: robot === selected ? 3 : 1.5, type: isDashed ? [6, 6] : "solid" },
        z: isDashed ? 4 : robot === selected ? 3 : 2,
      };
    };
    return [
      ...(isFew ? [] : [bandOptions(place, history, column, factor)]),
      ...robots.map(own),
    ];
  });
}

const SAME = 0.01; // relative difference of lines that cover each other

/** Return whether two lines cover each other. */
function areSame(a, b) {
  const isNear = (x, y) => !(Math.abs(x - y) > SAME * Math.max(Math.abs(x), Math.abs(y)));
  return a.every((value, i) => Number.isNaN(value) === Number.isNaN(b[i]) && isNear(value, b[i]));
}

/** A band between the least and the greatest value; where they are unknown, it has gaps. */
function bandOptions(place, history, column, factor) {
  const { least, greatest } = history.band(column);
  const low = points(history.times, least, factor);
  const high = points(history.times, greatest, factor);
  const fill = withAlpha(INK.limited, 0.35);
  return {
    ...place,
    type: "custom",
    name: `all ${history.count}: least to greatest`,
    color: fill,
    clip: true,
    data: low.map(([seconds, value], i) => [seconds, value, high[i][1]]),
    encode: { x: 0, y: [1, 2] },
    renderItem: ({ dataIndex }, api) => ({
      type: "group", // drawn once for all samples
      children: (dataIndex ? [] : stretches(low, high)).map((outline) => ({
        type: "polygon",
        shape: { points: outline.map((point) => api.coord(point)) },
        style: { fill },
      })),
    }),
  };
}

/** Return the outlines of a band, one for each stretch without gaps. */
export function stretches(low, high) {
  const outlines = [];
  let first = 0;
  for (let i = 0; i <= low.length; i += 1) {
    if (i === low.length || low[i][1] === null) {
      if (i - first > 1) {
        outlines.push([...high.slice(first, i), ...low.slice(first, i).reverse()]);
      }
      first = i + 1;
    }
  }
  return outlines;
}

/** Return [seconds before the newest, value]; unknown values are gaps. */
function points(times, values, factor) {
  const newest_s = times.at(-1);
  return values.map((value, i) => [
    times[i] - newest_s,
    Number.isFinite(value) ? value * factor : null,
  ]);
}
