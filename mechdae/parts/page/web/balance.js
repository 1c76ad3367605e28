/** What acts on each link of the pose shown, and the force plan of a group: loads are those of the file, inertia that of the pose. */
import { moment, subtracted, sum } from "./vectors.js";

/** Forces smaller than this share of the largest are none. */
const FORCELESS = 1e-9;
const LETTERS = { weight: "G", load: "P", inertia: "Φ" };

export class Balance {
  /** @param {any} session @param {any} equations of the pose @param {any} forces at it */
  constructor(session, equations, forces) {
    const { lesson, scene } = session.data;
    Object.assign(this, { equations, forces, lesson, joints: scene.joints, rows: [] });
    this.size = Math.max(0, ...Object.values(forces.reactions).map(([x, y]) => Math.hypot(x, y)));
    this.rows = this.acting(session);
    const marked = new Set(this.rows.filter(({ kind, force }) => kind === "load" && Math.hypot(...force) > 0).map(({ body }) => body));
    this.groups = this.lesson.groups.map(({ bodies }) => [...bodies].sort((a, b) => Number(marked.has(b)) - Number(marked.has(a))));
  }

  /** What acts on links beside reactions. */
  acting({ data, motion, forces: balanced, pose }) {
    const { equations, forces } = this, [rows, spots] = motion.kernels.acting.run(...balanced.inputs(pose).list).map((values) => Array.from(values));
    const ends = new Map(data.forces.bodies.map((body, k) => [body, [spots.slice(4 * k, 4 * k + 2), spots.slice(4 * k + 2, 4 * k + 4)]]));
    return data.forces.acting.map(([kind, name, body, point], k) => {
      const share = kind === "drive" ? forces.efforts[name] : kind === "inertia" && data.slow ? 0 : 1;
      const [x, y, m] = rows.slice(3 * k, 3 * k + 3).map((value) => value * share), force = [x, y], [origin, centre] = ends.get(body);
      const at = point ? equations.places[point] : kind === "load" && !(Math.hypot(x, y) > 0) ? origin : centre;
      const low = String(this.lesson.numbers[body]), letter = [LETTERS[kind] || (Math.hypot(x, y) > 0 ? "F" : "M"), low, kind === "load" ? name : ""];
      return { id: `force/${kind}/${name}/${body}`, kind, body, letter, force, at, couple: m - moment(subtracted(at, origin), force), where: point, name };
    });
  }

  /** Forces and couples on a link that do not vanish; of reactions also the joint and the link across it. */
  on(body) {
    const { numbers } = this.lesson, found = [];
    for (const { name, first, second } of this.joints) {
      const [one, two] = [first, second].map((end) => end.split(".")[0]), own = this.forces.reactions[name], sign = Number(two === body) - Number(one === body);
      if (!own || !sign) continue;
      const other = sign > 0 ? one : two, names = [other, body].map((end) => String(numbers[end] ?? (end === "ground" ? 0 : end)));
      found.push({ id: `thing-${name}`, kind: "reaction", body, joint: name, other, letter: ["R", names.join(names.some((text) => text.length > 1) ? "," : ""), ""],
        force: [sign * own[0], sign * own[1]], couple: sign * own[2], at: this.equations.places[second], where: second });
    }
    const long = Math.max(...found.map(({ at }) => Math.hypot(...subtracted(at, found[0].at))), 1e-300);
    return [...found, ...this.rows.filter((own) => own.body === body)].filter(({ force, couple }) => Math.hypot(...force) > FORCELESS * this.size || Math.abs(couple) > FORCELESS * this.size * long);
  }

  /** Where moments are taken about: the first pin of a link. */
  pole(body) {
    const held = this.joints.filter(({ first, second }) => [first, second].some((end) => end.split(".")[0] === body));
    return (held.find(({ pin }) => pin) || held[0]).second;
  }

  /** The force plan of a group: what acts on it from outside, link after link, and the reaction inside of two links. */
  plan(k) {
    const bodies = this.groups[k], arrows = [];
    let here = [0, 0];
    for (const body of bodies) {
      for (const { id, kind, force, letter, other } of this.on(body)) {
        if (bodies.includes(other) || !(Math.hypot(...force) > FORCELESS * this.size)) continue;
        const next = sum(here, force);
        arrows.push({ id, kind, from: here, to: next, letter });
        here = next;
      }
    }
    const inner = bodies.length === 2 ? this.on(bodies[1]).filter(({ other }) => other === bodies[0]) : [];
    if (inner.length === 1) arrows.push({ ...inner[0], kind: "inner", from: [0, 0], to: inner[0].force });
    return { arrows, lines: [], ends: [], unit: "N" };
  }
}
