/** Reactions, efforts, losses at a pose, friction acting on the reactions that it comes from. */
import { SAME, apart, goesOn, grown, newton, solutionsOf } from "./friction.js";

const SOLVED = 1e-12, UNIQUE = 0.98, DOUBTFUL = 1e-11, STANDING = 1e-9;
const SLOW = 1e-100; // share of the speeds of a driver that has none of its own: forces are those of a slow motion

export class Forces {
  /** @param {any} data @param {any} motion */
  constructor(data, motion) {
    this.data = data;
    this.own = data.forces;
    this.motion = motion;
    this.kernels = motion.kernels;
    this.of = new Map();
  }

  /** What the functions of the balance take, at a pose; null at limits and where there is none. */
  inputs(pose) {
    const { columns, tables, zero } = this.own;
    const { speed, acceleration, drivers, way } = this.data, { motion, motion: { p } } = this;
    if (!pose.y || pose.status !== "ok") return null;
    const driven = [motion.way.u(pose.place), ...(drivers ? motion.way.rates(pose.place) : [[speed], [acceleration]])];
    const [w, v, a] = [0, 1, 2].map((order) => [...motion.inTime(pose, columns, order), ...driven[order]]);
    if (![...v, ...a].every(Number.isFinite)) return null;
    const pace = this.motion.way.usual ? SLOW : 1;
    const [seen, gained] = [v.map((rate) => rate * pace), a.map((rate) => rate * pace * pace)];
    const at = tables.length ? this.kernels.abscissae.run(w, seen, p)[0] : [];
    const pieces = tables.flatMap((table, k) => piece(table, at[k]) || [NaN, NaN, NaN]);
    const [signs, still] = this.signs(pose, w, v, a);
    return { pace, list: [w, seen, gained, [drivers ? (way.kind === "law" ? pose.place : 0) : speed ? (pose.place - zero) / speed : 0], pieces, signs, p, [1]], still };
  }

  /** The sign of each sliding speed; where it vanishes that of the coming motion, 0 without any. */
  signs(pose, w, v, a) {
    const { slips, length } = this.own;
    if (!slips.length) return [[], false];
    const [speeds, largest] = this.kernels.slipping.run(w, v, this.motion.p);
    const along = Math.max(largest[1], largest[0] * length);
    const spin = Math.max(largest[0], length ? along / length : 0);
    const rough = DOUBTFUL * this.motion.condition(pose);
    const doubtful = speeds.map((value, k) => Math.abs(value) <= (slips[k] === "rad" ? spin : along) * rough);
    if (!doubtful.some(Boolean)) return [speeds.map(Math.sign), false];
    const [rates, change] = this.kernels.coming.run(w, v, a, this.motion.p);
    const turn = Math.max(change[0], spin ** 2);
    const shift = Math.max(change[1], turn * length);
    return [speeds.map((value, k) => {
      if (!doubtful[k]) return Math.sign(value);
      return Math.abs(rates[k]) > STANDING * (slips[k] === "rad" ? turn : shift) ? Math.sign(rates[k]) : 0;
    }), true];
  }

  /** The linear forms of each group at sizes, for a factor on all friction. */
  stage(list, factor, sizes, g) {
    const inputs = [...list.slice(0, 7), [factor]];
    const [starts, slopes] = this.kernels.stages.run(...inputs, sizes).map((own) => Array.from(own));
    let row = 0, cell = 0;
    for (let k = 0; ; k += 1) {
      const { places, forms } = this.own.groups[k];
      const rows = forms.reduce((sum, [from, to]) => sum + to - from, 0);
      if (k === g) {
        const at = (i, j) => slopes[cell + j * rows + i];
        return {
          start: forms.map(([from, to]) => starts.slice(row + from, row + to)),
          slope: forms.map(([from, to]) => Array.from({ length: to - from }, (_, i) => places.map((__, j) => at(from + i, j)))),
        };
      }
      row += rows;
      cell += rows * places.length;
    }
  }

  /** All sizes of friction at a pose where a few steps of Newton's method prove nothing. */
  every(list) {
    const { groups, feedbacks } = this.own;
    let fronts = [new Array(feedbacks.length).fill(0)];
    let proven = true;
    groups.forEach(({ places, laws }, g) => {
      fronts = fronts.flatMap((sizes) => {
        const { found, proven: sure } = solutionsOf(laws, this.stage(list, 1, sizes, g));
        proven = proven && sure;
        return found.map((m) => { const whole = [...sizes]; places.forEach((k, i) => { whole[k] = m[i]; }); return whole; });
      });
    });
    if (fronts.length === 1 && proven) return { sizes: fronts[0], count: 1, proven };
    const follow = (factor, sizes) => {
      const whole = [...sizes];
      for (let g = 0; g < groups.length; g += 1) {
        const { places, laws } = groups[g];
        const stage = this.stage(list, factor, whole, g);
        const m = newton(laws, stage, places.map((k) => whole[k]));
        if (!m || !goesOn(laws, stage, m)) return null;
        places.forEach((k, i) => { whole[k] = m[i]; });
      }
      return whole;
    };
    const { reached, sizes } = grown(follow, feedbacks.length);
    if (sizes && fronts.every((other) => apart(other, sizes) > SAME)) fronts.push(sizes);
    return { sizes: sizes || fronts[0] || null, count: fronts.length, proven, critical: sizes ? null : reached };
  }

  /** Forces at a pose: status "ok", "ambiguous", "jammed"; null where the pose has no rates. */
  at(pose) {
    const inputs = this.inputs(pose);
    if (!inputs) return null;
    const { joints, efforts, lossy, feedbacks, coupled, resistances } = this.own;
    const { list } = inputs;
    let sizes = [];
    let found = { count: 1, proven: true, critical: null };
    if (feedbacks.length) {
      const [law, m, misses, contractions] = this.kernels.sizes.run(...list);
      const good = misses.every((value) => value <= SOLVED) && contractions.every((value) => value <= UNIQUE);
      sizes = Array.from(coupled ? m : law);
      if (coupled && !good) { found = this.every(list); ({ sizes } = found); }
    }
    const status = found.count === 0 || !sizes ? "jammed" : found.count > 1 ? "ambiguous" : "ok";
    const none = { status, critical: found.critical, count: found.count, proven: found.proven, still: inputs.still, reactions: {}, efforts: {}, losses: {},
      senses: Object.fromEntries(resistances.map(([name, way, k]) => [name, way * list[5][k]])) };
    if (!sizes) return none;
    const [reactions, effort, losses] = this.kernels.report.run(...list, sizes);
    if (!reactions.every(Number.isFinite) || !effort.every(Number.isFinite)) return null;
    joints.forEach(({ name }, k) => { none.reactions[name] = Array.from(reactions.subarray(3 * k, 3 * k + 3)); });
    efforts.forEach((name, k) => { none.efforts[name] = effort[k]; });
    lossy.forEach((name, k) => { none.losses[name] = losses[k] / inputs.pace; });
    return none;
  }

  /** The largest difference from Python's forces at the file's numbers, relative to each kind. */
  selfTest() {
    const { checks, joints, lossy, efforts } = this.own;
    let worst = 0;
    const size = [0, 1, 2].map((k) => Math.max(1e-300, ...checks.flatMap(({ f }) => f[k].map(Math.abs))));
    for (const { s, f } of checks) {
      const found = this.at(this.motion.pose(s));
      if (!found || found.status === "jammed") return Infinity;
      if (found.still) continue; // a sign that Python settles in more digits
      const own = [joints.flatMap(({ name }) => found.reactions[name]), efforts.map((name) => found.efforts[name]), lossy.map((name) => found.losses[name])];
      own.forEach((values, k) => values.forEach((value, i) => { worst = Math.max(worst, Math.abs(value - f[k][i]) / size[k]); }));
    }
    return worst;
  }
}

/** Abscissa, value and slope of the piece of a table; null beside a table that ends. */
function piece({ rows, periodic }, at) {
  const first = rows[0][0], last = rows[rows.length - 1][0];
  let inside = at;
  if (periodic) inside = at - (last - first) * Math.floor((at - first) / (last - first));
  else if (at < first - 1e-12 * Math.max(Math.abs(first), Math.abs(last)) || at > last + 1e-12 * Math.max(Math.abs(first), Math.abs(last))) return null;
  let k = 0;
  while (k < rows.length - 2 && rows[k + 1][0] <= inside) k += 1;
  return [rows[k][0] + (at - inside), rows[k][1], (rows[k + 1][1] - rows[k][1]) / (rows[k + 1][0] - rows[k][0])];
}
