/** Poses that Python computed, where a page cannot solve again. */

/** Numbers from a list, null for none, from second differences, or from base64, little-endian float64. */
export function unpacked(text) {
  if (text.bent) {
    const whole = [];
    text.bent.forEach((bend, k) => { whole.push(bend + 2 * (whole[k - text.width] ?? 0) - (whole[k - 2 * text.width] ?? 0)); });
    return Float64Array.from(whole, (own) => own * text.step);
  }
  if (typeof text !== "string") return Float64Array.from(text, (value) => value ?? NaN);
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Float64Array.from({ length: bytes.length / 8 }, (_, k) => view.getFloat64(8 * k, true));
}

/** Values of a curve from 16 bits each; the largest is none. */
function curveOf([low, high, text]) {
  const letters = atob(text);
  return Array.from({ length: letters.length / 2 }, (_, k) => {
    const own = letters.charCodeAt(2 * k) + 256 * letters.charCodeAt(2 * k + 1);
    return own === 65535 ? null : low + ((high - low) * own) / 65534;
  });
}

export class Recorded {
  /** @param {any} data */
  constructor(data) {
    this.data = data;
    this.rows = data.recorded.rows;
    const { points, angles, turns } = data.recorded, tracks = (table) => Object.fromEntries(Object.keys(table).map((name) => [name, unpacked(table[table[name].like || name])]));
    [this.points, this.angles, this.rotations] = [tracks(points), Object.entries(tracks(angles)), tracks(turns)];
  }

  /** Curves that were stored: kind, part, names, unit, values of each. */
  get series() {
    this.curves ||= (this.data.recorded.series || []).map(([kind, part, names, unit, values]) => ({ kind, part, names, unit, values: values.map(curveOf) }));
    return this.curves;
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

  /** One coordinate of a point over the poses. */
  track(name, axis) {
    const width = this.data.scene.dimension;
    return Array.from({ length: this.count }, (_, k) => { const value = this.points[name][width * k + axis]; return Number.isFinite(value) ? value : null; });
  }

  get count() { return this.rows.length; }

  value(k) { return this.data.driver.values[k]; }

  /** How far along the way a pose is: in time, or in poses. */
  share(k) {
    const { unit, values } = this.data.driver;
    return unit === "s" ? (values[k] - values[0]) / (values[this.count - 1] - values[0] || 1) : k / this.count;
  }

  /** The last pose up to a share of the way. */
  at(share) {
    let k = 0;
    while (k + 1 < this.count && this.share(k + 1) <= share) k += 1;
    return k;
  }

  places(k) {
    const { ground, places: fixed, dimension: width } = this.data.scene;
    const places = Object.fromEntries(ground.map((name, i) => [name, fixed[i]]));
    for (const [name, numbers] of Object.entries(this.points)) {
      const place = Array.from(numbers.slice(width * k, width * (k + 1)));
      if (place.every(Number.isFinite)) places[name] = place;
    }
    return places;
  }

  /** Angles of bodies; in space their rotations, column by column. */
  turns(k) {
    if (this.data.scene.dimension === 2) return Object.fromEntries(this.angles.map(([name, own]) => [name, own[k]]));
    return Object.fromEntries(Object.entries(this.rotations).map(([name, own]) => {
      const [w, x, y, z] = own.slice(4 * k, 4 * k + 4);
      return [name, [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 2 * (x * y - w * z), 1 - 2 * (x * x + z * z),
        2 * (y * z + w * x), 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]];
    }));
  }

  status(k) { return this.data.status[k]; }
}
