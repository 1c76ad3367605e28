/** Poses that Python computed, where a page cannot solve again. */
import { sentence, words } from "./words.js";
import { quantity } from "./units.js";

/** Numbers of a list, in which null is none, or from second differences of rows. */
export function unpacked(stored) {
  const { bent, width, step } = stored, whole = [];
  if (!bent) return stored.map((value) => value ?? NaN);
  bent.forEach((bend, k) => { whole.push(bend + 2 * (whole[k - width] ?? 0) - (whole[k - 2 * width] ?? 0)); });
  return whole.map((own) => own * step);
}

/** Of more events of one kind at one part only the upper ends of their lines are drawn. */
const MOST_LINES = 8;

/** Events [time, kind, part] by kind and part: their times, and what is said of them together. */
function grouped(events) {
  const groups = new Map(), time = (at) => quantity(at, "s", 4);
  for (const [at, kind, part] of events) groups.set(`${words(kind)} ${part}`, [...(groups.get(`${words(kind)} ${part}`) || []), at]);
  return [...groups].map(([name, times]) => ({ times, many: times.length > MOST_LINES,
    about: times.length > 1 ? sentence("events_of", name, times.length, time(times[0]), time(times[times.length - 1])) : `${name}, t = ${time(times[0])}` }));
}

/** Poses along a task, shown as those of `Session` are; `s` counts them. */
export class Recorded {
  /** @param {any} data */
  constructor(data) {
    const { rows, points, angles, turns, series } = data.recorded, tracks = (table) => Object.fromEntries(Object.keys(table).map((name) => [name, unpacked(table[table[name].like || name])]));
    Object.assign(this, { data, live: false, forces: null, mode: "", s: 0, step: 1, clock: 0, places: data.driver.values });
    [this.points, this.angles, this.rotations] = [tracks(points), Object.entries(tracks(angles)), tracks(turns)];
    this.poses = rows.map((_, k) => ({ k, status: data.status[k] }));
    this.range = [0, rows.length - 1];
    this.motion = { way: data.driver, ends: [null, null] };
    /** Curves that were stored: kind, part, names, unit, values of each. */
    this.series = (series || []).map(([kind, part, names, unit, values]) => ({ kind, part, names, unit, values: values.map(unpacked) }));
    this.events = data.driver.unit === "s" ? grouped(data.recorded.events || []) : [];
  }

  get pose() { return this.poses[this.s]; }
  get value() { return this.places[this.s]; }
  forcesAt() { return null; }
  settle() {}
  drive(s) { this.s = Math.round(s); }

  /** The pose whose value is nearest. */
  at(value) {
    const apart = this.places.map((own) => Math.abs(own - value));
    return apart.indexOf(Math.min(...apart));
  }

  /** Play on: the whole way in six seconds, in time or in poses. */
  advance(seconds) {
    const { places, range: [, last] } = this, whole = places[last] - places[0] || 1;
    const share = (k) => (this.motion.way.unit === "s" ? (places[k] - places[0]) / whole : k / (last + 1));
    const shown = (clock) => { let k = 0; while (k < last && share(k + 1) <= clock) k += 1; return k; };
    if (shown(this.clock) !== this.s) this.clock = share(this.s);
    this.clock = (this.clock + seconds / 6) % 1;
    this.s = shown(this.clock);
  }

  /** Points that move, one for each place. */
  moving() {
    const seen = new Set();
    return Object.keys(this.points).filter((name) => {
      const width = this.data.scene.dimension, text = this.data.recorded.points[name], key = JSON.stringify(text), own = this.points[name];
      const moves = own.some((value, k) => Math.abs(value - own[k % width]) > 1e-9);
      return moves && !text.like && !seen.has(key) && seen.add(key);
    });
  }

  /** Where a point is in all poses, null where it has no place. */
  track(name) { return this.poses.map((pose) => this.place(name, pose)); }

  place(name, { k }) {
    const width = this.data.scene.dimension, own = Array.from(this.points[name].slice(width * k, width * (k + 1)));
    return own.every(Number.isFinite) ? own : null;
  }

  places_of(pose) {
    const { ground, places } = this.data.scene, found = Object.fromEntries(ground.map((name, i) => [name, places[i]]));
    for (const name of Object.keys(this.points)) {
      const place = this.place(name, pose);
      if (place) found[name] = place;
    }
    return found;
  }

  /** Angles of bodies; in space their rotations, column by column. */
  angles_of({ k }) {
    if (this.data.scene.dimension === 2) return Object.fromEntries(this.angles.map(([name, own]) => [name, own[k]]));
    return Object.fromEntries(Object.entries(this.rotations).map(([name, own]) => {
      const [w, x, y, z] = own.slice(4 * k, 4 * k + 4);
      return [name, [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 2 * (x * y - w * z), 1 - 2 * (x * x + z * z),
        2 * (y * z + w * x), 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]];
    }));
  }
}
