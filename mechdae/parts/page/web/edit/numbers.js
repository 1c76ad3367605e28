/** Numbers of a problem file: read in SI, and written where they stand: in the literal or in the parameter that is named. */
import { calculated } from "../arithmetic.js";
import { Refused } from "../read_toml.js";

const NAME = /[A-Za-z_][\w.]*/g, CALLED = new Set("sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt abs sign min max hypot pi".split(" "));

export class FileNumbers {
  /** @param {any} toml `TomlText` @param {any} units suffix -> [above, below, pi] */
  constructor(toml, units) {
    this.toml = toml;
    this.units = units;
    this.suffixes = Object.keys(units).sort((a, b) => b.length - a.length);
    this.open = new Set();
  }

  /** A key as its name and its suffix. */
  split(key) {
    const suffix = this.suffixes.find((own) => key.endsWith(own) && key.length > own.length) || "";
    return [key.slice(0, key.length - suffix.length), suffix];
  }

  /** Entries of a table by their names without suffixes: {path, suffix}. @param {(string | number)[]} path */
  table(path) {
    const found = new Map(), own = this.toml.get(path);
    if (own && typeof own === "object" && !Array.isArray(own)) for (const key of Object.keys(own)) { const [name, suffix] = this.split(key); found.set(name, { path: [...path, key], suffix }); }
    return found;
  }

  parameter(name) { return this.table(["parameters"]).get(name) || this.table(["sizes"]).get(name); }

  named(name) {
    const known = this.parameter(name);
    if (!known || this.open.has(name)) throw new Refused("no_number", 0, name);
    this.open.add(name);
    try { return this.read(known.path, known.suffix); } finally { this.open.delete(name); }
  }

  /** What one or more of a unit are in SI. */
  unit(suffix, number = 1) {
    if (!suffix) return number;
    const [above, below, pi] = this.units[suffix];
    return pi ? (number * Math.PI * above) / below : (number * above) / below;
  }

  /** The number at a place, in SI; names are those of parameters unless `valueOf` knows more. */
  read(path, suffix, valueOf = (name) => this.named(name)) {
    const value = this.toml.get(path), number = typeof value === "string" ? calculated(value, valueOf) : value;
    if (typeof number !== "number") throw new Refused("no_number", 0, String(value).slice(0, 60));
    return this.unit(suffix, number);
  }

  /** The number at a place of the file, which an error names. */
  at(where, { path, suffix }) {
    try { return this.read(path, suffix); } catch (error) {
      if (error instanceof Refused) error.about = `${where}: ${error.about}`;
      throw error;
    }
  }

  /** Names of parameters in an expression. */
  namesIn(text) { return [...new Set(text.match(NAME) || [])].filter((name) => !CALLED.has(name)); }

  /** Write a number in SI: into the literal, or into the one parameter that it comes from. @param {{path: any[], suffix: string}} place @param {number} si */
  write({ path, suffix }, si) {
    const text = this.toml.get(path), value = si / this.unit(suffix);
    if (typeof text !== "string") { this.toml.set(path, numeral(value)); return; }
    const names = this.namesIn(text);
    if (names.length !== 1) throw new Refused("several_parameters", 0, text);
    const [name] = names, of = (t) => calculated(text, () => t) - value;
    let [t, before] = [this.named(name), NaN], change = of(t);
    for (let round = 0; round < 50 && Math.abs(change) > 1e-15 * Math.max(1, Math.abs(value)); round += 1) {
      const step = Number.isNaN(before) ? 1e-6 * Math.max(1e-3, Math.abs(t)) : t - before, slope = (of(t + step) - change) / step;
      if (!(Math.abs(slope) > 0)) throw new Refused("several_parameters", 0, text);
      before = t;
      t -= change / slope;
      const next = of(t);
      if (next === change || t === before) break;
      change = next;
    }
    this.write(this.parameter(name), t);
  }
}

/** A number as it is typed: without what rounding adds. */
export const numeral = (value) => String(Number(value.toPrecision(13)) + 0);
