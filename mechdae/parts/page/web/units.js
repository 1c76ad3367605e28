/** Numbers as they are shown: degrees and millimetres. */

const FACTORS = { rad: [180 / Math.PI, "°"], m: [1000, "mm"], 1: [1, ""] };

const NAMES = {};
let decimalMark = ".";

/** Write units and numbers as a language does: name of a unit, or what is between two, -> name; and what is before decimals. */
export function nameIn(table, mark) {
  Object.assign(NAMES, table);
  decimalMark = mark;
}

/** Show units as somebody asked for: SI -> [factor, name]. */
export function showIn(table) {
  for (const [unit, [factor, name]] of Object.entries(table)) FACTORS[unit] = [factor, name === "deg" ? "°" : raised(name)];
}

const raised = (unit) => unit.replace(/(?<=[a-z])[23]/g, (power) => (power === "2" ? "²" : "³"));

/** @param {string} unit SI @returns {[number, string]} factor and name of what is shown */
export function displayed(unit) {
  const [factor, name] = FACTORS[unit] || [1, raised(unit)];
  return [factor, name.replace(/[A-Za-zµ]+| /g, (part) => NAMES[part] || part)];
}

/** At most so many significant digits, without zeros that say nothing. */
export function digits(value, count = 6) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  return localised(size >= 1e6 || size < 1e-4 ? value.toExponential(count - 2) : String(Number(value.toPrecision(count))));
}

/** A number as the language writes it. */
const localised = (text) => text.replace(".", decimalMark);

/** A value with its unit. */
export function quantity(value, unit, count = 6) {
  const [factor, name] = displayed(unit);
  return `${digits(value === null ? null : value * factor, count)}${name === "°" ? "°" : name ? ` ${name}` : ""}`;
}

/** A bound with its unit: two digits. */
export function rounded(value, unit) {
  const [factor, name] = displayed(unit);
  return `${value === 0 ? "0" : localised((value * factor).toExponential(1))}${name === "°" ? "°" : ` ${name}`}`;
}

/** The unit of a rate of a quantity. */
export function rateOf(unit, order) { return order === 0 ? unit : order === 1 ? `${unit}/s` : `${unit}/s2`; }
