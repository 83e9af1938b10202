/**
 * Colours of costmaps, robots and marks.
 */

const LIGHT = {
  background: "#eef1f5",
  floor: "#ffffff",
  plate: "#ffffff", // below texts, and in goals to come
  strong: "#000000", // what colours are mixed with to stand out from the floor
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
  muted: "#55616f",
  accent: "#0b5cc0",
  fault: "#c62828",
  waits: "#d97706",
  makesRoom: "#7c3aed",
  limited: "#64748b",
  contact: "#d50000",
};

const DARK = {
  ...LIGHT,
  background: "#0f1216",
  floor: "#1b2027",
  plate: "#171b21",
  strong: "#ffffff",
  grid: "#282f38",
  gridStrong: "#3b4450",
  wall: "#8b97a5",
  solid: "#5d6977",
  solidEdge: "#98a4b1",
  movingEdge: "#f0a184",
  passed: "#7b8794",
  text: "#e4e9ef",
  muted: "#a3afbb",
  accent: "#6fb1ff",
  fault: "#ff6b60",
  makesRoom: "#a78bfa",
  limited: "#94a3b8",
  contact: "#ff5252",
};

const scheme = matchMedia("(prefers-color-scheme: dark)");

/** Colours of everything that is not a robot, of the reader's colour scheme. */
export const INK = { ...(scheme.matches ? DARK : LIGHT) };

/** Tells with the event `change` that the colours of `INK` are other ones. */
export const inkChanges = new EventTarget();

scheme.addEventListener("change", () => {
  Object.assign(INK, scheme.matches ? DARK : LIGHT);
  inkChanges.dispatchEvent(new Event("change"));
});

const LEAST_LUMINANCE = 0.15; // of a robot's colour on the dark floor: a contrast of 3
const visible = new Map();

/** Return a robot's colour, lighter where the dark floor would hide it. */
export function seen(colour) {
  if (INK.strong === LIGHT.strong) {
    return colour;
  }
  if (!visible.has(colour)) {
    const steps = [0, 0.1, 0.2, 0.3, 0.4, 0.5].map((share) => mix(colour, INK.strong, share));
    visible.set(colour, steps.find((one) => luminance(one) >= LEAST_LUMINANCE) ?? steps.at(-1));
  }
  return visible.get(colour);
}

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

/** Return black or white, whichever is read better on a colour. */
export function textOn(colour) {
  return luminance(colour) > 0.36 ? "#000000" : "#ffffff";
}

/** Return WCAG's relative luminance. */
function luminance(colour) {
  const [red, green, blue] = parseColour(colour).map((part) => {
    const value = part / 255;
    return value <= 0.03928 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
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
