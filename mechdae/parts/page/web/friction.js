/** Sizes of friction that follow from the forces they act on: all solutions, and the one from no friction. */
import { eliminated, signOf } from "./path.js";
import { dot } from "./vectors.js";

export const SAME = 1e-6;
const SLACK = 1e-9, FINEST = 1e-10, STEPS = 16, CHOICES = 4096;

const most = (list) => list.reduce((best, value) => Math.max(best, Math.abs(value)), 0);
export const apart = (a, b) => most(a.map((value, k) => value - b[k])) / Math.max(most(a), most(b), 1e-300);

/** Linear forms of a group: `start[j]` is a list, `slope[j][row][k]`. @returns values at sizes m */
function formsAt({ start, slope }, m) { return start.map((own, j) => own.map((value, i) => value + dot(slope[j][i], m))); }

function sizesOf(laws, forms) {
  return forms.map((own, j) => (laws[j] === "length" ? Math.hypot(...own) : Math.max(...own)));
}

function slopesAt(laws, stage, m) {
  return formsAt(stage, m).map((form, j) => {
    const rows = stage.slope[j];
    if (laws[j] !== "length") return rows[form.indexOf(Math.max(...form))];
    const length = Math.max(Math.hypot(...form), 1e-300);
    return m.map((_, k) => form.reduce((sum, value, i) => sum + value * rows[i][k], 0) / length);
  });
}

const unit = (count) => Array.from({ length: count }, (_, i) => Array.from({ length: count }, (__, j) => (i === j ? 1 : 0)));
const less = (a, b) => a.map((row, i) => row.map((value, j) => value - b[i][j]));

/** Newton's method on m = size(L + S m); null without success. */
export function newton(laws, stage, first) {
  let m = [...first];
  const left = () => { const own = sizesOf(laws, formsAt(stage, m)); return m.map((value, k) => value - own[k]); };
  for (let round = 0; round < STEPS; round += 1) {
    const rest = left();
    const size = Math.max(most(m), 1e-300);
    if (!rest.every(Number.isFinite)) return null;
    if (most(rest) <= 4e-15 * size) return m;
    const step = eliminated(less(unit(m.length), slopesAt(laws, stage, m)), rest);
    if (!step) return null;
    m = m.map((value, k) => value - step[k]);
    if (most(step) <= 2e-16 * size) break;
  }
  return most(left()) <= 1e-11 * Math.max(most(m), 1e-300) ? m : null;
}

/** The m >= 0 with m = |vector + turn m|. */
function onePin(vector, turn) {
  const a = 1 - dot(turn, turn), b = dot(vector, turn), c = dot(vector, vector);
  if (c === 0) return [0];
  if (Math.abs(a) < 1e-14) return b < 0 ? [-c / (2 * b)] : [];
  const root = b * b + a * c;
  if (root < 0) return [];
  const far = b + (b < 0 ? -1 : 1) * Math.sqrt(root);
  return [...new Set(far ? [far / a, -c / far] : [0])].filter((m) => m >= 0);
}

/** All sizes that fit their laws, and whether there are no others. */
export function solutionsOf(laws, stage) {
  const { start, slope } = stage;
  const flat = laws.flatMap((law, j) => (law === "length" ? [] : [j]));
  const pins = laws.flatMap((law, j) => (law === "length" ? [j] : []));
  const counts = flat.map((j) => start[j].length);
  const many = counts.reduce((product, count) => product * count, 1);
  const found = [];
  if (many > CHOICES || pins.length > 1) {
    const m = newton(laws, stage, sizesOf(laws, start));
    return { found: m && m.every((value) => value >= 0) ? [m] : [], proven: false };
  }
  for (let number = 0; number < many; number += 1) {
    let rest = number;
    const choice = counts.map((count) => { const k = rest % count; rest = (rest - k) / count; return k; });
    // m_flat = first + onto m_pin, from (1 - A) m_flat = a + A_pin m_pin
    const solve = (right) => eliminated(flat.map((_, i) => flat.map((j, k) => (i === k ? 1 : 0) - slope[flat[i]][choice[i]][j])), right);
    const first = solve(flat.map((j, i) => start[j][choice[i]]));
    const onto = pins.length ? solve(flat.map((j, i) => slope[j][choice[i]][pins[0]])) : [];
    if (!first || !onto) continue;
    const whole = (pin) => laws.map((_, j) => (pins.includes(j) ? pin : first[flat.indexOf(j)] + (pins.length ? onto[flat.indexOf(j)] * pin : 0)));
    let own = [0];
    if (pins.length) {
      const [p] = pins;
      const along = (values) => slope[p].map((row) => flat.reduce((sum, j, k) => sum + row[j] * values[k], 0));
      const [still, moved] = [along(first), along(onto)];
      own = onePin(start[p].map((value, i) => value + still[i]), slope[p].map((row, i) => row[p] + moved[i]));
    }
    for (const m of own.map(whole)) {
      const forms = formsAt(stage, m);
      const slack = SLACK * most(m);
      const holds = m.every(Number.isFinite) && pins.every((j) => m[j] >= -slack)
        && flat.every((j, i) => forms[j][choice[i]] >= Math.max(...forms[j]) - slack);
      if (holds && found.every((other) => apart(m, other) > SAME)) found.push(m);
    }
  }
  return { found, proven: true };
}

/**
 * The solution that continues the one without friction, all coefficients grown from zero.
 * `follow(factor, sizes)` gives the sizes near known ones, null where they end.
 */
export function grown(follow, count) {
  let reached = 0, step = 1 / 16;
  let sizes = follow(0, new Array(count).fill(0));
  if (!sizes) return { reached: 0, sizes: null };
  while (reached < 1) {
    const ahead = Math.min(1, reached + step);
    const after = follow(ahead, sizes);
    if (!after) {
      step = (ahead - reached) / 2;
      if (step < FINEST) return { reached, sizes: null };
    } else {
      step = 2 * (ahead - reached);
      [reached, sizes] = [ahead, after];
    }
  }
  return { reached: 1, sizes };
}

/** Whether the branch of a solution still goes on: 1 - dsize/dm has kept its sign, nothing is negative. */
export function goesOn(laws, stage, m) {
  return m.every((value) => value >= 0) && signOf(less(unit(m.length), slopesAt(laws, stage, m))) > 0;
}
