// Metres, radians and pascals come from the server; people read millimetres, degrees and kilopascals.

const DISPLAY = {
  m: { factor: 1e3, unit: "mm", digits: 1 },
  rad: { factor: 180 / Math.PI, unit: "°", digits: 0 },
  mN: { factor: 1e3, unit: "mN", digits: 1 }, // of a value in newtons
  N: { factor: 1, unit: "N", digits: 2 },
  Pa: { factor: 1e-3, unit: "kPa", digits: 1 },
  1: { factor: 100, unit: "%", digits: 1 },
  "": { factor: 100, unit: "%", digits: 1 },
  "m/s": { factor: 1e3, unit: "mm/s", digits: 1 },
  "rad/s": { factor: 180 / Math.PI, unit: "°/s", digits: 0 },
  "N/s": { factor: 1, unit: "N/s", digits: 2 },
};

/** How a unit of the messages is shown: factor to multiply by, the unit's sign, digits after the point. */
export const display = (unit) => DISPLAY[unit] ?? { factor: 1, unit, digits: 2 };

export const isNumber = (value) => typeof value === "number" && Number.isFinite(value);

/** A number with a true minus sign, or an en dash where there is none. */
export function fixed(value, digits) {
  if (!isNumber(value)) return "–";
  const text = value.toFixed(digits);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

/** A value of the messages as people read it: "12.3 mm". */
export function shown(value, unit, digits) {
  const how = display(unit);
  return `${fixed(isNumber(value) ? value * how.factor : value, digits ?? how.digits)}\u202f${how.unit}`;
}

export const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

/** The smallest number of a list that may hold nulls, and where: [value, index]; [null, -1] where there is none. */
export function least(values) {
  let best = null;
  let at = -1;
  (values ?? []).forEach((value, index) => {
    if (isNumber(value) && (best === null || value < best)) [best, at] = [value, index];
  });
  return [best, at];
}

/** The least clearance at each place of the body over all structures; [] where the message has none. */
export function bodyClearance(clearance) {
  const rows = Object.values(clearance ?? {}).filter((row) => row.length);
  if (!rows.length) return [];
  return rows[0].map((_, i) => rows.reduce((low, row) => (isNumber(row[i]) && row[i] < low ? row[i] : low), Infinity));
}

/** A sentence with a capital, if it begins with a word of small letters; "page-1" and the like stay. */
export const capital = (text) => (/^[a-z]+[ ,:]/.test(text) ? text.charAt(0).toUpperCase() + text.slice(1) : text);

/** The name of the target nearest to the tip that was not reached yet; undefined where there is none. */
export function nearestOf({ targets, reached }) {
  const open = Object.keys(targets).filter((name) => !reached.includes(name));
  return open.reduce((best, name) => (best === undefined || targets[name] < targets[best] ? name : best), undefined);
}

/** Minutes, seconds and tenths of a session's clock. */
export function clock(seconds) {
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${(seconds - 60 * minutes).toFixed(1).padStart(4, "0")}`;
}
