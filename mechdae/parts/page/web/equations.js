/** The vector equations of a pose, group by group, in the plane and in space: v_C = v_B + v_CB, a_C = a_B + a^n_CB + a^τ_CB, and past slides with Coriolis' term. */
import { dot, outer, subtracted, sum } from "./vectors.js";

/** Vectors shorter than this share of the longest are points. */
const SILENT = 1e-9;
const SYMBOL = ["r", "v", "a"];

/** What a vector gains by turning with an angular velocity. */
const across = (arm, w) => (arm.length > 2 ? outer(w, arm) : [-w * arm[1], w * arm[0]]);

/** Places and rates of the spots of a pose, and its equations. */
export class Equations {
  /** @param {any} session @param {any} pose @param {(vector: number[]) => number[]} flat as it is seen on the sheet */
  constructor(session, pose, flat) {
    const { data } = session, { lesson } = data;
    this.places = session.places_of(pose);
    this.flat = flat;
    this.still = new Array(data.scene.dimension).fill(0);
    const fixed = data.scene.dimension > 2 ? this.still : 0;
    this.spins = new Map([["ground", [fixed, fixed, fixed]]]);
    this.points = new Map();
    for (const entry of data.entries) {
      const rates = [0, 1, 2].map((order) => session.told(pose, entry, order));
      if (entry.kind === "bodies") this.spins.set(entry.part, rates.map((own) => (own && own.length === 1 ? own[0] : own ?? NaN)));
      else if (entry.kind === "points") this.points.set(entry.part, rates);
    }
    this.base = new Map([...this.points.keys()].map((name) => [name.split(".")[0], name]));
    this.joints = new Map(data.scene.joints.map((joint) => [joint.name, joint]));
    this.spots = lesson.spots.map((spot) => this.spot(spot));
    this.rated = this.spots.every(({ rates }) => rates[2].every(Number.isFinite));
    this.size = [1, 2].map((order) => Math.max(0, ...this.spots.map(({ rates }) => Math.hypot(...rates[order]))));
    this.groups = lesson.groups.map((group, k) => ({ ...group, k, all: group.all.map((own) => this.equation(own)) }));
  }

  /** Where a point of a body is, and its velocity and acceleration. */
  spot([body, reference, letter]) {
    const under = this.joints.get(reference), place = this.places[under ? under.second : reference] || this.still.map(() => NaN);
    const rates = [place, ...[1, 2].map((order) => (!under && this.points.has(reference) ? this.points.get(reference)[order] || this.still.map(() => NaN) : this.rate(body, place, order)))];
    return { body, reference, letter, rates };
  }

  /** The rate of the point of a body that is at a place. */
  rate(body, place, order) {
    if (body === "ground") return this.still;
    const known = this.points.get(this.base.get(body)), [, w, e] = this.spins.get(body) || [];
    if (!known || !known[order] || w === undefined) return this.still.map(() => NaN);
    const arm = subtracted(place, known[0]);
    return order === 1 ? sum(known[1], across(arm, w)) : sum(known[2], across(arm, e), across(across(arm, w), w));
  }

  /** An equation with the terms of both orders: kind, letter, vector. */
  equation({ joint, start, end }) {
    const [from, to] = [this.spot(start), this.spot(end)], names = `${to.letter}${from.letter}`;
    const [, w, e] = this.spins.get(to.body) || [], arm = subtracted(to.rates[0], from.rates[0]);
    const [v, a] = [1, 2].map((own) => subtracted(to.rates[own], from.rates[own]));
    let terms;
    if (!joint && w === undefined) { // spins freely: what is known is along the arm
      const normal = arm.map((value) => (value * dot(a, arm)) / dot(arm, arm));
      terms = [[], [["relative", "", v]], [["normal", "n", normal], ["tangential", "τ", subtracted(a, normal)]]];
    } else if (!joint) terms = [[], [["relative", "", across(arm, w)]], [["normal", "n", across(across(arm, w), w)], ["tangential", "τ", across(arm, e)]]];
    else {
      const { first } = this.joints.get(joint), [, rider] = this.spins.get(first.split(".")[0]) || [], turned = across(v, rider).map((value) => 2 * value);
      terms = [[], [["sliding", "r", v]], [["coriolis", "k", turned], ["sliding", "r", subtracted(a, turned)]]];
    }
    return { joint, start: from, end: to, arm, terms: terms.map((own, order) => own.map(([kind, high, vector]) => ({ id: `${order}/${kind}/${names}`, kind, order, letter: [SYMBOL[order], names, high], vector }))) };
  }

  /** The vector of a spot itself. */
  whole(spot, order) { return { id: `${order}/total/${spot.letter}`, kind: "total", order, letter: [SYMBOL[order], spot.letter, ""], vector: spot.rates[order] }; }

  /** What is on the right of an equation, without what vanishes. */
  right(equation, order) {
    return [this.whole(equation.start, order), ...equation.terms[order]].filter(({ vector }) => Math.hypot(...vector) > SILENT * this.size[order - 1]);
  }

  /** The plan of velocities or accelerations: arrows, lettered ends, sides of images; of one group or of all. */
  plan(order, only = null) {
    const size = this.size[order - 1], pole = this.spots.some(({ letter }) => letter === "P") ? "pᵥ" : "p"; // p is the image of P
    const arrows = [], ends = [{ text: order === 1 ? pole : "π", at: this.still }], lines = [], counts = {}, { flat } = this;
    const add = (id, kind, from, vector, letter) => {
      const to = sum(from, vector);
      if (Math.hypot(...vector) > SILENT * size && !arrows.some((own) => Math.hypot(...subtracted(own.to, to), ...subtracted(own.from, from)) < 1e-7 * size)) arrows.push({ id, kind, from, to, letter });
    };
    const groups = this.groups.filter((group) => only === null || group.k === only);
    const met = new Set(groups.flatMap(({ all }) => all.flatMap(({ start, end }) => [start.letter, end.letter])));
    for (const spot of this.spots) {
      if (only !== null && !met.has(spot.letter)) continue;
      const at = spot.rates[order], small = spot.letter.charAt(0).toLowerCase() + spot.letter.slice(1);
      add(this.whole(spot, order).id, "total", this.still, at, this.whole(spot, order).letter);
      const same = ends.find((own) => Math.hypot(...subtracted(own.at, at)) < 1e-6 * size);
      if (!same) ends.push({ text: small, at });
      else if (!same.text.split(", ").includes(small)) same.text += `, ${small}`;
    }
    for (const { all, bodies } of groups) {
      for (const { start, terms } of all) {
        let here = start.rates[order];
        terms[order].forEach(({ id, kind, vector, letter }, k) => {
          add(id, kind, here, vector, letter);
          here = sum(here, vector);
          if (k + 1 === terms[order].length || !(Math.hypot(...vector) > SILENT * size)) return;
          counts[kind] = (counts[kind] || 0) + 1;
          ends.push({ text: `${kind === "normal" ? "n" : "k"}_${counts[kind]}`, at: here });
        });
      }
      for (const body of bodies) {
        const own = this.spots.filter((spot) => spot.body === body).map(({ rates }) => rates[order]).filter((at, k, every) => every.findIndex((other) => Math.hypot(...subtracted(at, other)) < 1e-9 * size) === k);
        if (own.length > 2) own.forEach((at, k) => lines.push([at, own[(k + 1) % own.length]]));
      }
    }
    return { arrows: arrows.map((own) => ({ ...own, from: flat(own.from), to: flat(own.to) })), lines: lines.map((own) => own.map(flat)),
      ends: ends.map(({ text, at }) => ({ text, at: flat(at) })), unit: order === 1 ? "m/s" : "m/s2" };
  }
}
