/** Poses that Python computed, where a page cannot solve anew. */

/** Numbers from base64, little-endian float64. */
export function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Float64Array.from({ length: bytes.length / 8 }, (_, k) => view.getFloat64(8 * k, true));
}

export class Recorded {
  /** @param {any} data */
  constructor(data) {
    this.data = data;
    this.rows = data.recorded.rows;
    this.points = Object.fromEntries(Object.entries(data.recorded.points).map(([name, text]) => [name, unpacked(text)]));
  }

  get count() { return this.rows.length; }

  value(k) { return this.data.driver.values[k]; }

  places(k) {
    const { ground, places: fixed } = this.data.scene;
    const places = Object.fromEntries(ground.map((name, i) => [name, fixed[i]]));
    for (const [name, numbers] of Object.entries(this.points)) {
      const [x, y] = [numbers[2 * k], numbers[2 * k + 1]];
      if (Number.isFinite(x + y)) places[name] = [x, y];
    }
    return places;
  }

  status(k) { return this.data.status[k]; }
}
