/**
 * Equations of a drawn mechanism as rows of two kinds, with derivatives and their bounds: lengths are in units of the
 * mechanism's size, unknowns are x, y and angle of each body, then where on its curve each follower is.
 *
 * along: e . (P2 - P1) + sum c_k angle_k + constant - a curve's place, e turning with a body; distance: (d . d / l - l) / 2 with d = P2 - P1.
 */

import { FULL_TURN } from "../way.js";

const NEAREST = 128;
/** A point that is fixed in a body (-1: the ground). */
const pointOn = (k, [x, y]) => ({ k, x, y, r: k < 0 ? 0 : Math.hypot(x, y), moves: k < 0 ? 0 : 1 });

/** Most of the second derivative of a curve that a row follows. */
const bendOf = ({ follows }) => (follows ? follows.loop.bends[follows.axis] / follows.size : 0);

/** Rows that a coordinate or an equation is made of. */
export class Rows {
  /** @param {any} mechanism @param {number} size */
  constructor(mechanism, size) {
    Object.assign(this, { mechanism, size });
    this.index = new Map(mechanism.bodies.map(({ name }, k) => [name, k]));
    /** Where on their curves followers are: an angle each, behind the places of bodies. */
    this.loops = mechanism.joints.filter(({ drawn, loop }) => drawn && loop).map((joint, k) => ({ joint, at: 3 * mechanism.bodies.length + k }));
    this.n = 3 * mechanism.bodies.length + this.loops.length;
    this.joints = mechanism.joints.filter(({ drawn }) => drawn).flatMap((joint) => this.rowsOf(joint).map((row) => ({ ...row, name: joint.name })));
  }

  point(reference) {
    const [body, name] = reference.split(".");
    return pointOn(this.index.get(body) ?? -1, this.mechanism.pointsOf(body).get(name).map((v) => v / this.size));
  }

  body(name) { return this.index.get(name) ?? -1; }

  along(first, second, turning, angle, more = {}) {
    return { one: this.point(first), two: this.point(second), k: this.body(turning), angle, linear: [], constant: 0, ...more };
  }

  linear(pairs, constant, more = {}) { return { one: null, linear: pairs.map(([name, c]) => [this.body(name), c]).filter(([k]) => k >= 0), constant, ...more }; }

  rowsOf(joint) {
    const { kind, first, second, axis, turn, carrier } = joint;
    const [a, b] = [first, second].map((reference) => reference.split(".")[0]);
    const together = (angle) => this.along(first, second, "ground", angle);
    const turned = () => this.linear([[b, 1], [a, -1]], -turn, { wraps: true });
    const meshed = (ratio, phase) => this.linear([[a, 1], [b, -ratio], [carrier, ratio - 1]], -phase);
    if (kind === "revolute") return [together(0), together(Math.PI / 2)];
    if (kind === "weld") return [together(0), together(Math.PI / 2), turned()];
    if (kind === "prismatic") return [this.along(first, second, a, axis + Math.PI / 2), turned()];
    if (kind === "pin-in-slot") return [this.along(first, second, a, axis + Math.PI / 2)];
    if (kind === "distance") return [{ ...together(0), length: joint.length / this.size }];
    if (kind === "curve") {
      const { at } = this.loops.find((own) => own.joint === joint);
      return [0, 1].map((axis) => this.along(first, second, a, (axis * Math.PI) / 2, { follows: { at, axis, loop: joint.loop, size: this.size } }));
    }
    if (kind === "rack") {
      const radius = joint.radius / this.size;
      const turns = this.linear([[a, -radius], [carrier, radius]], 0).linear;
      return [this.along(first, second, b, axis, { linear: turns, constant: -joint.phase / this.size })];
    }
    return [meshed(joint.ratio, joint.phase)];
  }

  /** Unknowns with the places of followers nearest to where bodies are. @param {number[]} q of the bodies at least */
  followed(q) {
    const place = new Place(q), all = q.slice(0, this.n);
    for (const { joint: { first, second, loop }, at } of this.loops) {
      const row = this.along(first, second, first.split(".")[0], 0), [dx, dy, , , , , c, s] = place.parts(row), [u, v] = [c * dx + s * dy, c * dy - s * dx].map((one) => one * this.size);
      const far = (angle) => { const [x, y] = loop.at(angle); return Math.hypot(x - u, y - v); };
      all[at] = Array.from({ length: NEAREST }, (_, k) => (FULL_TURN * k) / NEAREST).reduce((best, angle) => (far(angle) < far(best) ? angle : best));
    }
    return all;
  }

  /** The row of a coordinate, whose `unit` is what a number of it is divided by; null for one that is not known. */
  coordinate(name) {
    const parts = name.split("."), key = parts.pop(), owner = parts[0];
    if (parts.length === 2 && this.index.has(owner) && (key === "x" || key === "y") && this.mechanism.pointsOf(owner).has(parts[1])) {
      const two = this.point(parts.join("."));
      return { one: pointOn(-1, [0, 0]), two, k: -1, angle: key === "x" ? 0 : Math.PI / 2, linear: [], constant: 0, unit: this.size };
    }
    if (key === "angle" && this.index.has(owner)) return this.linear([[owner, 1]], 0, { unit: 1 });
    const joint = this.mechanism.joints.find((own) => own.name === owner && own.drawn);
    if (!joint) return null;
    const [a, b] = [joint.first, joint.second].map((reference) => reference.split(".")[0]);
    if (key === "angle" && ["revolute", "pin-in-slot"].includes(joint.kind)) return this.linear([[b, 1], [a, -1]], 0, { unit: 1 });
    if (key === "slide" && ["prismatic", "pin-in-slot"].includes(joint.kind)) return this.along(joint.first, joint.second, a, joint.axis, { unit: this.size });
    return null;
  }
}

/** Places of everything at unknowns q, computed once for all rows. */
export class Place {
  constructor(q) {
    this.q = q;
    this.trig = [];
    for (let k = 0; 3 * k < q.length; k += 1) this.trig.push([Math.cos(q[3 * k + 2]), Math.sin(q[3 * k + 2])]);
  }

  /** Place and arm of a point: [x, y, arm x, arm y]. */
  of({ k, x, y }) {
    if (k < 0) return [x, y, 0, 0];
    const [c, s] = this.trig[k], u = c * x - s * y, v = s * x + c * y;
    return [this.q[3 * k] + u, this.q[3 * k + 1] + v, u, v];
  }

  direction(k, angle) {
    const turn = angle + (k < 0 ? 0 : this.q[3 * k + 2]);
    return [Math.cos(turn), Math.sin(turn)];
  }

  /** What rows are evaluated by: the difference of the points, their arms, the direction. */
  parts(row) {
    const [x1, y1, u1, v1] = this.of(row.one), [x2, y2, u2, v2] = this.of(row.two);
    return [x2 - x1, y2 - y1, u1, v1, u2, v2, ...(row.length ? [0, 0] : this.direction(row.k, row.angle))];
  }

  value(row) {
    let sum = row.constant;
    for (const [k, c] of row.linear) sum += c * this.q[3 * k + 2];
    if (row.wraps) return sum - FULL_TURN * Math.round(sum / FULL_TURN);
    if (!row.one) return sum;
    const [dx, dy, , , , , c, s] = this.parts(row);
    return row.length ? ((dx * dx + dy * dy) / row.length - row.length) / 2 : sum + c * dx + s * dy - this.curve(row, 0);
  }

  /** Where a row's follower is on its curve, or a derivative of that. */
  curve({ follows }, order) { return follows ? follows.loop.value(this.q[follows.at], follows.axis, order) / follows.size : 0; }

  /** Add the gradient of a row to a list of n numbers. */
  gradient(row, line) {
    for (const [k, c] of row.linear) line[3 * k + 2] += c;
    if (!row.one) return line;
    const parts = this.parts(row), [dx, dy, u1, v1, u2, v2] = parts;
    let [, , , , , , c, s] = parts;
    if (row.length) [c, s] = [dx / row.length, dy / row.length];
    else if (row.k >= 0) line[3 * row.k + 2] += c * dy - s * dx;
    if (row.follows) line[row.follows.at] -= this.curve(row, 1);
    const add = ({ k }, u, v, sign) => {
      if (k < 0) return;
      line[3 * k] += sign * c;
      line[3 * k + 1] += sign * s;
      line[3 * k + 2] += sign * (s * u - c * v);
    };
    add(row.one, u1, v1, -1);
    add(row.two, u2, v2, 1);
    return line;
  }

  /** The second derivative of a row along rates v. */
  bend(row, v) {
    if (!row.one) return 0;
    const [dx, dy, u1, v1, u2, v2, c, s] = this.parts(row);
    const rate = ({ k }, u, w) => (k < 0 ? [0, 0, 0] : [v[3 * k] - v[3 * k + 2] * w, v[3 * k + 1] + v[3 * k + 2] * u, v[3 * k + 2]]);
    const [p1, q1, w1] = rate(row.one, u1, v1), [p2, q2, w2] = rate(row.two, u2, v2);
    const [px, py] = [p2 - p1, q2 - q1], [ax, ay] = [w1 * w1 * u1 - w2 * w2 * u2, w1 * w1 * v1 - w2 * w2 * v2];
    if (row.length) return (px * px + py * py + dx * ax + dy * ay) / row.length;
    const w = row.k < 0 ? 0 : v[3 * row.k + 2];
    return c * ax + s * ay + 2 * w * (c * py - s * px) - w * w * (c * dx + s * dy) - (row.follows ? this.curve(row, 2) * v[row.follows.at] ** 2 : 0);
  }

  /** Longest difference of a row's points where unknowns differ by 1 in all. */
  reach(row) {
    const [dx, dy] = this.parts(row);
    return Math.hypot(dx, dy) + Math.SQRT2 * (row.one.moves + row.two.moves) + row.one.r + row.two.r;
  }

  /** How far the gradient may change per unit of the unknowns, which differ by 1 at most. */
  lipschitz(row) {
    if (!row.one) return 0;
    const { one, two } = row, reach = row.length || row.k >= 0 ? this.reach(row) : 0;
    if (row.length) return (2 * (one.moves + two.moves) + one.r ** 2 + two.r ** 2 + reach * (one.r + two.r)) / row.length;
    return bendOf(row) + one.r + two.r + (row.k < 0 ? 0 : reach + Math.SQRT2 * (one.moves + two.moves + one.r + two.r));
  }

  /**
   * Along q + v t, 0 <= t <= ds: most of the second derivative of a row, and of the change of its gradient, which is
   * put into a line of n numbers.
   */
  ahead(row, v, ds, line) {
    line.fill(0);
    if (!row.one) return 0;
    const { one, two } = row, turn = (k) => (k < 0 ? 0 : Math.abs(v[3 * k + 2]));
    const part = (j) => (two.k < 0 ? 0 : v[3 * two.k + j]) - (one.k < 0 ? 0 : v[3 * one.k + j]);
    const [w1, w2, w] = [turn(one.k), turn(two.k), row.length ? 0 : turn(row.k)];
    const speed = Math.hypot(part(0), part(1)) + one.r * w1 + two.r * w2, [dx, dy] = this.parts(row);
    const reach = Math.hypot(dx, dy) + ds * speed;
    const sides = [[one, w1], [two, w2]];
    for (const [{ k, r }, own] of sides) {
      if (k < 0) continue;
      const share = row.length ? (speed * ds) / row.length : w * ds;
      line[3 * k] += share;
      line[3 * k + 1] += share;
      line[3 * k + 2] += row.length ? (r * (speed + reach * own) * ds) / row.length : r * (w + own) * ds;
    }
    const arms = one.r * w1 * w1 + two.r * w2 * w2;
    if (row.length) return (speed * speed + reach * arms) / row.length;
    if (row.k >= 0) line[3 * row.k + 2] += (reach * w + speed) * ds;
    const rate = row.follows ? Math.abs(v[row.follows.at]) : 0;
    if (rate) line[row.follows.at] += bendOf(row) * rate * ds;
    return arms + 2 * w * speed + w * w * reach + bendOf(row) * rate * rate;
  }
}

/** The inverse of a matrix, in the place of its rows, with the sign of its determinant; null where it is singular. */
export function inverted(rows) {
  const n = rows.length, swaps = new Int32Array(n);
  let sign = 1;
  for (let k = 0; k < n; k += 1) {
    let best = k;
    for (let i = k + 1; i < n; i += 1) if (Math.abs(rows[i][k]) > Math.abs(rows[best][k])) best = i;
    swaps[k] = best;
    if (best !== k) { [rows[k], rows[best]] = [rows[best], rows[k]]; sign = -sign; }
    const line = rows[k], pivot = line[k];
    if (!(Math.abs(pivot) > 0)) return null;
    sign *= Math.sign(pivot);
    line[k] = 1;
    for (let j = 0; j < n; j += 1) line[j] /= pivot;
    for (let i = 0; i < n; i += 1) {
      const other = rows[i], share = other[k];
      if (i === k || share === 0) continue;
      other[k] = 0;
      for (let j = 0; j < n; j += 1) other[j] -= share * line[j];
    }
  }
  for (let k = n - 1; k >= 0; k -= 1) if (swaps[k] !== k) for (const line of rows) [line[k], line[swaps[k]]] = [line[swaps[k]], line[k]];
  return { rows, sign };
}

/** A matrix of rows times a vector. */
export const applied = (rows, vector) => rows.map((line) => { let sum = 0; for (let j = 0; j < line.length; j += 1) sum += line[j] * vector[j]; return sum; });
