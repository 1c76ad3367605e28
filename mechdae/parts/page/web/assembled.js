/** Closes the links of a rough sketch: Levenberg-Marquardt, whatever the number of equations. */
import { eliminated } from "./path.js";

const CLOSE = 1e-9, SHUT = 1e-13, MOST_ROUNDS = 200;

/** The pose near q with the driver at u (null: none); q itself where the links close. @returns {number[] | null} */
export function assembled(draft, q, u) {
  const { size } = draft;
  const scale = q.map((_, j) => (j % 3 === 2 ? 1 : size));
  const at = (place) => {
    const rows = draft.joints.flatMap(({ rows: made }) => made(place)).map(({ value, slopes }) => ({ value: value / size, slopes: slopes.map(([j, v]) => [j, v / size]) }));
    if (u !== null) {
      const { value, slopes } = draft.driven(place, u), unit = draft.model.driver.kind === "turn" ? 1 : size;
      rows.push({ value: value / unit, slopes: slopes.map(([j, v]) => [j, v / unit]) });
    }
    const worst = Math.max(0, ...rows.map(({ value }) => Math.abs(value)));
    return { rows, worst, sum: rows.reduce((sum, { value }) => sum + value * value, 0) };
  };
  let now = at(q), place = q, damping = 1e-3;
  if (now.worst <= CLOSE) return q;
  for (let round = 0; round < MOST_ROUNDS && now.worst > SHUT; round += 1) {
    const normal = q.map(() => new Array(q.length).fill(0)), right = new Array(q.length).fill(0);
    for (const { value, slopes } of now.rows) {
      for (const [i, a] of slopes) {
        right[i] += a * scale[i] * value;
        for (const [j, b] of slopes) normal[i][j] += a * scale[i] * b * scale[j];
      }
    }
    normal.forEach((line, i) => { line[i] += damping; });
    const step = eliminated(normal, right);
    if (!step || !step.every(Number.isFinite)) return null;
    const tried = place.map((value, j) => value - scale[j] * step[j]);
    const next = at(tried);
    if (next.sum < now.sum) { [now, place] = [next, tried]; damping = Math.max(damping / 10, 1e-15); } else if ((damping *= 10) > 1e6) break;
  }
  return now.worst <= 1e-12 ? place : null;
}
