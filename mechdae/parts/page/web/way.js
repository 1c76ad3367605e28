/** What a pose is led along: a driver's value, one of several drivers, straight legs between their values, a law of time. */

export const FULL_TURN = 2 * Math.PI;
export const STEP_OF_TURN = FULL_TURN / 128;

/** Sums of lists, entry by entry: one + factor other. */
const along = (one, other, factor) => one.map((value, k) => value + factor * other[k]);

/** A way along one line of the drivers' values, without legs; other ways differ from it. */
class Way {
  constructor(known) { Object.assign(this, { turns: false, whole: false, prefix: "", pace: 0 }, known); }

  /** Rates of several drivers in time. */
  rates() { return this.given; }
  legAt() { return 0; }
  /** How far one leg leads towards a place. */
  end(leg, sense, to) { return to; }
  /** The line of a leg: u = u0 + s d. */
  lineOf() { return this.line; }
  largest() { return this.step; }
}

/** One driver of several, the others held where `u` has them; the only one of a mechanism with one. */
class Alone extends Way {
  /** @param {number[]} u @param {number} k @param {any} known name, unit, turns, step and more */
  constructor(u, k, known) {
    super(known);
    this.k = k;
    this.held = u.map((value, i) => (i === k ? 0 : value));
    this.direction = u.map((_, i) => (i === k ? 1 : 0));
    this.line = [...this.held, ...this.direction];
  }

  u(s) { return this.direction.map((own, i) => (own ? s : this.held[i])); }
}

/** Straight legs from corner to corner; whole numbers are corners. */
class Legs extends Way {
  constructor({ corners, largest, name, unit, rates }, range) {
    super({ corners, name, unit, range, sizes: largest, given: [...rates, rates[0].map(() => 0)] });
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

  end(leg, sense, to) { return sense > 0 ? Math.min(leg + 1, to) : Math.max(leg, to); }
  lineOf(leg) { return [...along(this.corners[leg], this.directions[leg], -leg), ...this.directions[leg]]; }
  largest(leg) { return this.sizes[leg]; }
}

/** Laws of time. */
class Law extends Way {
  constructor({ name, unit, largest, u }, range, kernel) {
    super({ name, unit, range, pace: 1, step: largest, kernel, line: [...u, ...u].map(() => 0) });
  }

  u(t) { return Array.from(this.kernel.run([t])[0]); }
  rates(t) { return this.kernel.run([t]).slice(1).map((part) => Array.from(part)); }
}

/** The way of the file. @returns {any} */
export function wayOf(data, kernels) {
  const { way, range, start } = data;
  if (way.kind === "law") return new Law(way, range, kernels.course);
  if (way.kind === "legs") return new Legs(way, range);
  if (way.kind === "alone") return Object.assign(aloneOf(data, way.u, way.driver), { range, whole: data.whole, step: way.largest });
  return new Alone(way.u, 0, { name: data.driver.name, unit: data.driver.unit, turns: start.turns, step: start.largest, range, whole: data.whole, pace: data.speed, given: [] });
}

/** Where the turn begins that an angle is in; rounding leaves no angle below its turn. */
export const turnOf = (angle) => FULL_TURN * Math.floor(angle / FULL_TURN + 1e-9);

/** One of several drivers that moves from values u, the others held. */
export function aloneOf(data, u, k) {
  const { name, unit, turns, size, speed, acceleration, usual } = data.drivers[k], begin = turns ? turnOf(u[k]) : u[k];
  const given = [speed, acceleration, 0].map((rate) => u.map((_, i) => (i === k ? rate : 0)));
  return new Alone(u, k, { name, unit, turns, usual, given, pace: speed, whole: true, range: [begin, begin], step: STEP_OF_TURN * size, prefix: lines(data) }); // usual: nobody gave its speed
}

/** A straight line from values u of several drivers to others. */
export function straightOf(data, u, to) {
  const length = Math.max(...to.map((value, k) => Math.abs(value - u[k]) / data.drivers[k].size));
  const still = u.map(() => 0);
  const own = new Legs({ corners: [u, to], largest: [length > STEP_OF_TURN ? STEP_OF_TURN / length : 1], name: "", unit: "", rates: [still, still] }, [0, 1]);
  return Object.assign(own, { prefix: lines(data) });
}

/** What the names of functions of straight lines begin with: beside a law they have their own. */
const lines = (data) => (data.way.kind === "law" ? "line_" : "");
