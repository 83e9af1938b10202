/**
 * Colours of costmaps, robots and marks.
 */

/** Colours of everything that is not a robot. */
export const INK = {
  background: "#eef1f5",
  floor: "#ffffff",
  grid: "#e4e8ee",
  gridStrong: "#cfd6df",
  wall: "#3b4654",
  solid: "#7b8794",
  solidEdge: "#4b5766",
  moving: "#cc5c33",
  movingEdge: "#7d3217",
  tracked: "#f2591a",
  suspect: "#f2bf0d",
  passed: "#aab4c0",
  text: "#1f2933",
  accent: "#0b63ce",
  fault: "#c62828",
  waits: "#d97706",
  makesRoom: "#7c3aed",
  limited: "#64748b",
  contact: "#d50000",
};

const HEX = /^#[0-9a-f]{6}$/i;

/** Return [red, green, blue] in 0..255 of `#rrggbb`; grey for anything else. */
export function parseColour(text) {
  if (!HEX.test(text)) {
    return [128, 128, 128];
  }
  const number = parseInt(text.slice(1), 16);
  return [number >> 16, (number >> 8) & 255, number & 255];
}

/** Return a colour with an opacity in 0..1, as CSS. */
export function withAlpha(colour, alpha) {
  return `rgba(${parseColour(colour).join(",")},${alpha})`;
}

/** Return a mix of two colours: the first one for a share of 0, the second one for 1. */
export function mix(colour, other, share) {
  const [a, b] = [parseColour(colour), parseColour(other)];
  const mixed = a.map((part, i) => Math.round(part + (b[i] - part) * share));
  return `#${mixed.map((part) => part.toString(16).padStart(2, "0")).join("")}`;
}

/** Return black or white, whichever is read better on a colour (WCAG's relative luminance). */
export function textOn(colour) {
  const [red, green, blue] = parseColour(colour).map((part) => {
    const value = part / 255;
    return value <= 0.03928 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue > 0.36 ? "#000000" : "#ffffff";
}

/** Return [red, green, blue, alpha] of an occupancy value, as RViz's costmap scheme has it. */
export function costColour(cost) {
  if (cost === 0) {
    return [0, 0, 0, 0];
  }
  if (cost >= 1 && cost <= 98) {
    const red = Math.floor((255 * cost) / 100);
    return [red, 0, 255 - red, 255];
  }
  if (cost === 99) {
    return [0, 255, 255, 255];
  }
  if (cost === 100) {
    return [255, 0, 255, 255];
  }
  if (cost > 100) {
    return [0, 255, 0, 255];
  }
  if (cost === -1) {
    return [0x70, 0x89, 0x86, 255];
  }
  return [255, Math.floor((255 * (cost + 128)) / 126), 0, 255];
}

/** RGBA of each occupancy value, by its value as uint8, in the order of ImageData. */
const COST_TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  const [red, green, blue, alpha] = costColour(byte < 128 ? byte : byte - 256);
  return ((alpha << 24) | (blue << 16) | (green << 8) | red) >>> 0;
});

/** Paint a costmap onto a canvas, one pixel for each cell, first row at the top. */
export function paintCosts(canvas, { values, shape: [rows, columns] }) {
  if (canvas.width !== columns || canvas.height !== rows) {
    canvas.width = columns;
    canvas.height = rows;
  }
  const context = canvas.getContext("2d");
  const image = context.createImageData(columns, rows);
  const pixels = new Uint32Array(image.data.buffer);
  for (let i = 0; i < pixels.length; i += 1) {
    pixels[i] = COST_TABLE[values[i] & 255];
  }
  context.putImageData(image, 0, 0);
}
