/** Mechanisms for a curve: the nearest of the atlas, laid onto it by correlation, the best of them fitted. */
import { around, FAMILIES, timed } from "./families.js";
import { momentsOf, NUMBERS } from "./moments.js";
import { Fit } from "./refine.js";
import { extent, hausdorff, measured, resampled } from "./targets.js";

const PLACES = 64, FINE = 128;

/** How a curve is best laid onto another with as many places: the shift of the start, the factor (turn and size) by least squares, what is left. */
function laid(w, z, n) {
  let best = { left: Infinity, shift: 0, factor: [1, 0] }, power = 0, size = 0;
  for (let k = 0; k < 2 * n; k += 1) { power += w[k] * w[k]; size += z[k] * z[k]; }
  const put = (shift) => {
    let [re, im] = [0, 0];
    for (let k = 0, j = 2 * shift; k < 2 * n; k += 2, j += 2) { // z[k + shift] conj(w[k])
      if (j === 2 * n) j = 0;
      re += z[j] * w[k] + z[j + 1] * w[k + 1];
      im += z[j + 1] * w[k] - z[j] * w[k + 1];
    }
    const left = size - (re * re + im * im) / power;
    if (left < best.left) best = { left, shift, factor: [re / power, im / power] };
  };
  for (let shift = 0; shift < n; shift += 2) put(shift);
  const { shift } = best;
  put((shift + 1) % n);
  put((shift + n - 1) % n);
  return best;
}

const mirrored = (z) => z.map((v, k) => (k % 2 ? -v : v));
const backward = (z) => { const n = z.length / 2; return z.map((_, k) => z[2 * ((n - (k >> 1)) % n) + (k % 2)]); };

export class Search {
  /** @param {any} atlas @param {Float64Array} curve closed polyline @param {number[][] | null} points places to be met in their order; null: the curve itself */
  constructor(atlas, curve, points = null) {
    this.atlas = atlas;
    const { centre, size } = measured(resampled(curve, curve.length / 2, 256).places);
    this.centre = centre;
    this.size = size;
    this.unit = (z) => z.map((v, k) => (v - centre[k % 2]) / size);
    this.curve = this.unit(resampled(curve, curve.length / 2, PLACES).places);
    this.share = 1 / extent(this.curve);
    /** The curve itself, for how far it is passed. */
    this.whole = this.unit(curve.length > 800 ? resampled(curve, curve.length / 2, 400).places : curve);
    this.targets = points ? this.unit(Float64Array.from(points.flat())) : this.curve;
    this.points = points;
    this.found = [];
    this.tried = 0;
    this.fits = FAMILIES.map((_, family) => new Fit(family, this.targets.length / 2));
    this.queue = this.candidates();
  }

  /** Candidates, best first, laid onto the curve. */
  candidates(many = 240) {
    const numbers = new Float64Array(NUMBERS);
    const fine = this.curve;
    if (!momentsOf(fine, PLACES, numbers, 0, new Float64Array(PLACES + 1))) return [];
    this.sides = [fine, mirrored(fine)];
    const room = { U: new Float64Array(2 * FINE), V: new Float64Array(2 * FINE), z: new Float64Array(2 * FINE), tau: around(FINE) };
    const centred = this.sides.map((side) => { const { centre } = measured(side); return [side.map((v, k) => v - centre[k % 2]), centre]; });
    const ways = centred.map(([side]) => [side, backward(side)]);
    const all = this.atlas.near(numbers, many).flat().map(([index, mirror]) => {
      const { family, x, q } = this.atlas.at(index), { U, V, z, tau } = room;
      if (!FAMILIES[family].trace(x, tau, U, V)) return null;
      for (let k = 0; k < 2 * FINE; k += 2) { z[k] = U[k] + q[0] * V[k] - q[1] * V[k + 1]; z[k + 1] = U[k + 1] + q[0] * V[k + 1] + q[1] * V[k]; }
      const { places, shares } = resampled(z, FINE, PLACES), own = measured(places);
      const w = places.map((v, k) => v - own.centre[k % 2]);
      const [ahead, back] = ways[Number(mirror)].map((side) => laid(w, side, PLACES));
      return { family, x, q, mirror, shares, place: own.centre, back: back.left < ahead.left, ...(back.left < ahead.left ? back : ahead) };
    }).filter(Boolean);
    // families take turns, simple ones more often
    const lists = FAMILIES.map((_, family) => all.filter((own) => own.family === family).sort((a, b) => a.left - b.left));
    lists.forEach((list, family) => list.forEach((own, k) => { own.turn = k / FAMILIES[family].turns; }));
    return lists.flat().sort((a, b) => a.turn - b.turn);
  }

  /** The numbers to begin with: o, p, q, x, and the driver at each place of the curve. */
  begun({ x, q, mirror, back, shares, shift, factor, place }) {
    const [a, b] = factor, { centre } = measured(this.sides[Number(mirror)]), tau = new Float64Array(PLACES);
    for (let k = 0; k < PLACES; k += 1) { // the place k of the mechanism is the place k + shift of the curve, or of the curve backward
      const j = (k + shift) % PLACES;
      tau[back ? (PLACES - j) % PLACES : j] = timed(shares[k]);
    }
    const o = [centre[0] - (a * place[0] - b * place[1]), centre[1] - (a * place[1] + b * place[0])];
    return { y: Float64Array.from([...o, a, b, a * q[0] - b * q[1], a * q[1] + b * q[0], ...x]), tau };
  }

  /** The driver at the places that are to be met: that of the nearest place of the curve. */
  times(tau, side, targets) {
    return Float64Array.from({ length: targets.length / 2 }, (_, k) => {
      let [best, least] = [0, Infinity];
      for (let j = 0; j < PLACES; j += 1) {
        const far = (side[2 * j] - targets[2 * k]) ** 2 + (side[2 * j + 1] - targets[2 * k + 1]) ** 2;
        if (far < least) [best, least] = [j, far];
      }
      return tau[best];
    });
  }

  /** Fit the next candidates for some milliseconds; false when there are none. */
  work(milliseconds) {
    const end = performance.now() + milliseconds, n = this.targets.length / 2;
    while (this.queue.length && performance.now() < end) {
      this.tried += 1;
      const candidate = this.queue.shift(), side = this.sides[Number(candidate.mirror)];
      const { y, tau } = this.begun(candidate);
      const targets = this.points ? (candidate.mirror ? mirrored(this.targets) : this.targets) : side;
      const times = this.points ? this.times(tau, side, targets) : tau;
      const eighth = this.found.filter(({ family }) => family === candidate.family)[7], least = eighth ? eighth.miss : Infinity, good = 100 * least ** 2 * n;
      const miss = Math.sqrt(this.fits[candidate.family].fit(y, times, targets, 60, good) / n);
      if (!Number.isFinite(miss)) continue;
            const own = { family: candidate.family, mirror: candidate.mirror, y, miss, times };
      if (miss > 2 * least || this.found.some((known) => same(own, known))) continue;
      const whole = this.traced(own, FINE);
      if (!whole) continue;
      own.error = this.points ? miss * this.share : hausdorff(this.unit(whole), this.whole) * this.share;
      this.found.push(own);
      this.found.sort((one, two) => one.error - two.error);
    }
    return this.queue.length > 0;
  }

  /** The closed curve of a solution where it is wanted, as n places. */
  traced({ family, mirror, y }, n) {
    const fit = new Fit(family, n), z = new Float64Array(2 * n);
    if (!fit.placed(y, around(n), fit.U, fit.V, z)) return null;
    return z.map((v, k) => this.centre[k % 2] + this.size * (mirror && k % 2 ? -v : v));
  }
}

/** Whether two solutions are the same mechanism. */
function same(one, two) {
  if (one.family !== two.family || one.mirror !== two.mirror) return false;
  let apart = 0;
  for (let k = 0; k < one.y.length; k += 1) apart = Math.max(apart, Math.abs(one.y[k] - two.y[k]) / (1 + Math.abs(one.y[k])));
  return apart < 0.02;
}
