/** What a pose is led along: a driver's value, one of several drivers, straight legs between their values, a law of time. */

const ROUND_TURN = 2 * Math.PI, STEPS_OF_TURN = 128;

/** Sums of lists, entry by entry: one + factor other. */
const along = (one, other, factor) => one.map((value, k) => value + factor * other[k]);

/** One driver of several, the others held where `u` has them; the only one of a mechanism with one. */
export class Alone {
  /** @param {number[]} u @param {number} k @param {any} [driver] of several @param {number} [largest] */
  constructor(u, k, driver, largest) {
    this.k = k;
    this.held = u.map((value, i) => (i === k ? 0 : value));
    this.direction = u.map((_, i) => (i === k ? 1 : 0));
    this.line = [...this.held, ...this.direction];
    this.step = largest ?? (ROUND_TURN / STEPS_OF_TURN) * driver.size;
    this.prefix = "";
    if (!driver) return;
    this.name = driver.name;
    this.unit = driver.unit;
    this.turns = driver.turns;
    this.pace = driver.speed;
    this.usual = driver.usual; // nobody gave it
    this.given = [driver.speed, driver.acceleration, 0].map((rate) => this.direction.map((own) => own * rate));
    this.whole = true;
    const begin = driver.turns ? ROUND_TURN * Math.floor(u[k] / ROUND_TURN) : u[k];
    this.range = [begin, begin];
  }

  u(s) { return this.direction.map((own, i) => (own ? s : this.held[i])); }
  /** Rates of several drivers in time. */
  rates() { return this.given; }
  legAt() { return 0; }
  end(leg, sense, to) { return to; }
  lineOf() { return this.line; }
  largest() { return this.step; }
}

/** Straight legs from corner to corner; whole numbers are corners. */
export class Legs {
  constructor({ corners, largest, name, unit, rates }, range) {
    Object.assign(this, { corners, name, unit, range, turns: false, whole: false, prefix: "", pace: 0, sizes: largest });
    this.given = [...rates, rates[0].map(() => 0)];
    this.directions = corners.slice(1).map((corner, k) => corner.map((value, i) => value - corners[k][i]));
  }

  legAt(s, sense) {
    const k = sense > 0 ? Math.floor(s) : Math.ceil(s) - 1;
    return Math.min(Math.max(k, 0), this.directions.length - 1);
  }

  u(s) {
    const k = this.legAt(s, 1);
    return along(this.corners[k], this.directions[k], s - k);
  }

  rates() { return this.given; }
  /** How far one leg leads towards a place. */
  end(leg, sense, to) { return sense > 0 ? Math.min(leg + 1, to) : Math.max(leg, to); }
  lineOf(leg) { return [...along(this.corners[leg], this.directions[leg], -leg), ...this.directions[leg]]; }
  largest(leg) { return this.sizes[leg]; }
}

/** Laws of time. */
export class Law {
  constructor({ name, unit, largest, u }, range, kernel) {
    Object.assign(this, { name, unit, range, turns: false, whole: false, prefix: "", pace: 1, step: largest, kernel });
    this.line = [...u, ...u].map(() => 0);
  }

  u(t) { return Array.from(this.kernel.run([t])[0]); }
  rates(t) { return this.kernel.run([t]).slice(1).map((part) => Array.from(part)); }
  legAt() { return 0; }
  end(leg, sense, to) { return to; }
  lineOf() { return this.line; }
  largest() { return this.step; }
}

/** The way of the file. @returns {any} */
export function wayOf(data, kernels) {
  const { way, range, start } = data;
  if (way.kind === "law") return new Law(way, range, kernels.course);
  if (way.kind === "legs") return new Legs(way, range);
  if (way.kind === "alone") return Object.assign(aloneOf(data, way.u, way.driver), { range, whole: data.whole, step: way.largest });
  const own = new Alone(way.u, 0, null, start.largest);
  return Object.assign(own, { name: data.driver.name, unit: data.driver.unit, turns: start.turns, range, whole: data.whole, pace: data.speed, given: [] });
}

/** One of several drivers that moves from values u, the others held. */
export function aloneOf(data, u, k) {
  return Object.assign(new Alone(u, k, data.drivers[k]), { prefix: lines(data) });
}

/** A straight line from values u of several drivers to others. */
export function straightOf(data, u, to) {
  const length = Math.max(...to.map((value, k) => Math.abs(value - u[k]) / data.drivers[k].size));
  const share = ROUND_TURN / STEPS_OF_TURN;
  const still = u.map(() => 0);
  const own = new Legs({ corners: [u, to], largest: [length > share ? share / length : 1], name: "", unit: "", rates: [still, still] }, [0, 1]);
  return Object.assign(own, { prefix: lines(data) });
}

/** What the names of functions of straight lines begin with: beside a law they have their own. */
const lines = (data) => (data.way.kind === "law" ? "line_" : "");
