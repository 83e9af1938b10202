/**
 * Options of ECharts for the four charts of samples.
 */

import { INK, withAlpha } from "./colours.js";
import { SPAN_S } from "./samples.js";

const FOUR_COLUMNS_PX = 860;
const TWO_COLUMNS_PX = 340;
const FONT = "Roboto, system-ui, sans-serif";

/** Up to so many robots have a line each; a larger fleet has a band. */
export const FEW_ROBOTS = 3;

/** Title with its unit, and factor to that unit, of each column of the samples. */
export const CHARTS = [
  { title: "Gap to the nearest robot, m", factor: 1 },
  { title: "Clearance to obstacles, m", factor: 1 },
  { title: "Speed, m/s", factor: 1 },
  { title: "Control cycle, ms", factor: 1000 },
];

/** Return titles, grids and axes for a size in pixels. */
export function layoutOptions(width, height) {
  const columns = width >= FOUR_COLUMNS_PX ? 4 : width >= TWO_COLUMNS_PX ? 2 : 1;
  const rows = CHARTS.length / columns;
  const [cellWidth, cellHeight] = [width / columns, height / rows];
  const corner = (i) => [(i % columns) * cellWidth, Math.floor(i / columns) * cellHeight];
  const text = { fontFamily: FONT, fontSize: 11, color: "#52606d" };
  return {
    animation: false,
    textStyle: text,
    title: CHARTS.map(({ title }, i) => ({
      text: title,
      left: corner(i)[0] + 8,
      top: corner(i)[1] + 2,
      textStyle: { ...text, fontSize: 12, fontWeight: 500, color: INK.text },
    })),
    grid: CHARTS.map((_, i) => ({
      left: corner(i)[0] + 36,
      top: corner(i)[1] + 24,
      width: Math.max(cellWidth - 50, 20),
      height: Math.max(cellHeight - 46, 20),
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
      splitNumber: 3,
      axisLabel: text,
      axisLine: { show: false, onZero: false },
      axisTick: { show: false },
      splitLine: { lineStyle: { color: INK.grid } },
    })),
  };
}

/**
 * Return the lines of all charts.
 *
 * @param {import("./samples.js").SampleHistory} history
 * @param {?number} selected Number of the robot whose line is bold.
 * @param {(robot: number) => string} colourOf
 */
export function seriesOptions(history, selected, colourOf) {
  const isFew = history.count <= FEW_ROBOTS;
  const robots = [...Array(isFew ? history.count : 0).keys()].filter((i) => i !== selected);
  const hasSelected = selected !== null && selected < history.count;
  return CHARTS.flatMap(({ factor }, column) => {
    const place = { type: "line", xAxisIndex: column, yAxisIndex: column, showSymbol: false };
    const own = (robot, width) => ({
      ...place,
      silent: true,
      data: points(history.times, history.line(robot, column), factor),
      lineStyle: { width, color: colourOf(robot) },
    });
    return [
      ...(isFew ? [] : bandOptions(place, history, column, factor)),
      ...robots.map((robot) => own(robot, 1.5)),
      ...(hasSelected ? [own(selected, 3)] : []),
    ];
  });
}

/** A band between the least and the greatest value; where they are unknown, it has gaps. */
function bandOptions(place, history, column, factor) {
  const { least, greatest } = history.band(column);
  const low = points(history.times, least, factor);
  const high = points(history.times, greatest, factor);
  return [
    {
      ...place,
      type: "custom",
      silent: true,
      clip: true,
      data: low.map(([seconds, value], i) => [seconds, value, high[i][1]]),
      encode: { x: 0, y: [1, 2] },
      renderItem: ({ dataIndex }, api) => ({
        type: "group", // drawn once for all samples
        children: dataIndex ? [] : stretches(low, high).map((points) => polygon(points, api)),
      }),
    },
  ];
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

function polygon(points, api) {
  const fill = withAlpha(INK.limited, 0.35);
  const shape = { points: points.map((point) => api.coord(point)) };
  return { type: "polygon", shape, style: { fill } };
}

/** Return [seconds before the newest, value]; unknown values are gaps. */
function points(times, values, factor) {
  const newest_s = times[times.length - 1];
  return values.map((value, i) => [
    times[i] - newest_s,
    Number.isFinite(value) ? value * factor : null,
  ]);
}
