// Colours of the anatomy by role and of the robot by clearance or pressure, for dark and light pages.

/** One look per role: colour on dark, ink on light, opacity seen head on and at the rim, drawing order, mm between the
 * vertices that a slow browser draws. */
export const ROLES = {
  cord: { colour: "#e8b48f", ink: "#c07a4c", face: 0.42, rim: 0.85, order: 2, label: "Cord" },
  dura: { colour: "#8fb4d8", ink: "#4f83b8", face: 0.07, rim: 0.5, order: 4, label: "Dura" },
  canal: { colour: "#9fb6c3", ink: "#6d8797", face: 0.03, rim: 0.34, order: 6, cell: 2, label: "Canal" },
  bone: { colour: "#e6dcc3", ink: "#a08c5c", face: 0.05, rim: 0.55, order: 7, cell: 2.2, label: "Bone" },
  disc: { colour: "#8fc7bd", ink: "#3f8f83", face: 0.08, rim: 0.5, order: 6, cell: 2, label: "Discs" },
  root: { colour: "#f0d060", ink: "#b8930f", face: 0.45, rim: 0.85, order: 3, label: "Roots" },
  ganglion: { colour: "#f2a33c", ink: "#c9740a", face: 0.55, rim: 0.95, order: 3, label: "Ganglia" },
  ligament: { colour: "#d9a7c7", ink: "#a8659b", face: 0.08, rim: 0.45, order: 5, label: "Ligaments" },
};

export const lookOf = (role) => ROLES[role] ?? { colour: "#9aa7b0", ink: "#66747e", face: 0.05, rim: 0.45, order: 5, label: role };

/** The colour of a look that can be told from the page's ground. */
export const inkOf = (look, theme) => (theme.isLight ? look.ink : look.colour);

/** Scales: stops [value in the shown unit, red, green, blue (0..255)], ends in words. Safe for red-green blindness. */
export const SCALES = {
  clearance: {
    unit: "mm", factor: 1e3, ticks: [0, 0.5, 1, 2], text: "From the tube’s wall to the nearest tissue, mm",
    stops: [[0, 213, 40, 90], [0.25, 240, 110, 60], [0.5, 250, 190, 70], [1, 150, 215, 150], [2, 40, 170, 190]],
  },
  pressure: {
    unit: "kPa", factor: 1e-3, ticks: [0, 2.4, 4.8, 7.2], text: "Pressure on tissue, kPa. The limit is an engineering choice.",
    stops: [[0, 110, 170, 190], [0.4, 150, 215, 150], [2.4, 250, 190, 70], [4.8, 240, 110, 60], [7.2, 213, 40, 90]],
  },
};

/** The colour of a value in the shown unit, as [r, g, b] of 0..1, written into `out` at `at`. */
export function paint(scale, value, out, at) {
  const stops = scale.stops;
  const shown = Number.isFinite(value) ? value : stops.at(-1)[0];
  let i = 1;
  while (i < stops.length - 1 && shown > stops[i][0]) i += 1;
  const [low, high] = [stops[i - 1], stops[i]];
  const share = Math.min(1, Math.max(0, (shown - low[0]) / (high[0] - low[0])));
  for (let k = 0; k < 3; k += 1) out[at + k] = (low[k + 1] + share * (high[k + 1] - low[k + 1])) / 255;
}

/** The scale as a CSS-like list of [share of the width, "rgb(..)"] for a legend that is linear in the value. */
export function legendStops(scale) {
  const span = scale.stops.at(-1)[0] - scale.stops[0][0];
  return scale.stops.map(([value, r, g, b]) => [(value - scale.stops[0][0]) / span, `rgb(${r} ${g} ${b})`]);
}
