/** How this pose is computed on paper: group after group, positions, velocities, accelerations; then forces, the last group first. */
import { arrow, element } from "./view.js";
import { moment, subtracted } from "./vectors.js";
import { lightable } from "./light.js";
import { find, made, rowOf, symbol, tableOf, written } from "./made.js";
import { sentence, words } from "./words.js";
import { digits, displayed, quantity, rateOf } from "./units.js";
import { drawPlan, planSheet } from "./plans.js";

const ORDERS = ["positions", "velocities_of", "accelerations", "tab_forces"], FORCES = 3;
/** Arrows in the diagram: the longest one; half of a line that points slide along [units]. */
const LONGEST = 62, REACH = 120;

export class Explain {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    const { groups } = app.data.lesson;
    this.flat = app.data.scene.dimension === 2;
    this.steps = groups.flatMap((group, k) => [0, 1, 2].map((order) => ({ k, order })));
    if (app.session.forces) this.steps.push(...groups.map((group, k) => ({ k, order: FORCES })).reverse());
    this.step = 0;
    this.layer = element("g", { class: "explained" }, app.diagram.svg);
    const go = (by, key, text) => made("button", { type: "button", title: words(key), "aria-label": words(key), onclick: () => this.go(by) }, text);
    this.title = made("h2", {});
    this.body = made("div", { class: "paper" });
    this.sheet = planSheet(words("plan"));
    find("explain").append(made("div", { class: "steps" }, go(-1, "before", "‹"), this.title, go(1, "next", "›")), this.body, this.sheet);
  }

  go(by) {
    this.step = (this.step + by + this.steps.length) % this.steps.length;
    this.frame();
  }

  whole(anew) { if (anew) this.sheet.room = null; }

  /** Nothing of it is drawn where another tab is shown; reactions are not drawn twice. */
  clear() {
    this.layer.replaceChildren();
    this.app.diagram.layers.forces.style.display = "";
  }

  frame() {
    const { k, order } = this.steps[this.step], { app } = this, equations = app.equations();
    const step = `${this.step + 1}/${this.steps.length}  ${sentence("group", app.data.lesson.groups[k].name)}: ${words(ORDERS[order])}`;
    if (step !== this.title.textContent) { this.title.textContent = step; this.sheet.room = null; }
    const group = equations && equations.groups[k], balance = group && order === FORCES ? app.balance() : null;
    this.clear();
    app.diagram.layers.forces.style.display = "none";
    const there = group && (order === FORCES ? balance : order ? equations.rated : true), planned = there && order && (balance || group.all.length);
    if (app.reading) this.body.replaceChildren(...(!there ? [made("p", {}, words("none"))] : balance ? this.balanced(balance, k) : this.written(equations, group, order)));
    this.sheet.style.display = planned ? "block" : "none"; // before it is measured
    if (!there) return;
    if (planned) drawPlan(this.sheet, balance ? balance.plan(k) : equations.plan(order, k), "");
    if (balance) this.forces(balance, k);
    else if (order) this.arrows(equations, group, order);
    else this.circles(equations, group);
  }

  /** The equilibrium of each link of a group: its forces in letters, their sizes and moments, which add up to nothing. */
  balanced(balance, k) {
    const { numbers, letters } = this.app.data.lesson, zero = (value, size) => (Math.abs(value) < 1e-9 * size ? 0 : value);
    return balance.groups[k].flatMap((body) => {
      const acting = balance.on(body), forced = acting.filter(({ force }) => Math.hypot(...force) > 0), title = made("p", {}, made("b", {}, `${numbers[body]} ${body}`));
      if (!acting.length) return [title, made("p", {}, words("unloaded"))];
      const pole = balance.pole(body), about = balance.equations.places[pole];
      const rows = acting.map((own) => ({ ...own, total: own.couple + moment(subtracted(own.at, about), own.force) }));
      const most = Math.max(...rows.map(({ total }) => Math.abs(total))), size = Math.max(...rows.map(({ force }) => Math.hypot(...force)));
      const place = ({ kind, where, name }) => (where ? written(letters[where] || where.split(".")[1]) : kind === "load" ? name : words(kind === "drive" ? "driver" : "mass_centre"));
      const cells = ([x, y], total) => [digits(zero(x, size), 5), digits(zero(y, size), 5), digits(zero(total, most), 5)];
      const last = rowOf("Σ", "", ...cells([0, 1].map((i) => rows.reduce((all, { force }) => all + force[i], 0)), rows.reduce((all, { total }) => all + total, 0)));
      last.className = "sum";
      return [title, made("p", { class: "formula" }, ...forced.flatMap(({ id, letter }, i) => [i ? " + " : "", lightable(made("span", { class: "term" }, symbol(letter)), id)]), ...(forced.length ? [" = 0"] : [])),
        tableOf([words("vector"), words("acts_at"), "F x, N", "F y, N", `M ${written(letters[pole] || pole)}, N·m`],
          [...rows.map((own) => this.litRow(own.id, symbol(own.letter), place(own), ...cells(own.force, own.total))), last])];
    });
  }

  /** The forces on the links of a group where they act. */
  forces(balance, k) {
    const every = balance.groups[k].flatMap((body) => balance.on(body)), size = Math.max(0, ...every.map(({ force }) => Math.hypot(...force)));
    for (const { id, kind, force: [x, y], at } of every) {
      const long = (LONGEST * Math.hypot(x, y)) / size;
      if (long > 3) arrow(lightable(element("g", { class: `vector ${kind}` }, this.layer), id), this.app.diagram.at(at), [x, -y], long, "");
    }
  }

  /** What is to be read: facts, equations in letters and numbers, vectors, values. */
  written(equations, group, order) {
    const { lesson } = this.app.data, title = (body) => (body === "ground" ? words("frame") : `${lesson.numbers[body]} ${body}`);
    const line = (...parts) => made("p", {}, ...parts), rows = [];
    const starts = [...new Set(group.all.filter(({ start }) => !group.bodies.includes(start.body) || this.outside(start, group)).map(({ start }) => written(start.letter)))];
    if (order === 0) {
      rows.push(line(made("b", {}, `${words("links")} `), group.bodies.map(title).join(", ")));
      rows.push(line(made("b", {}, `${words("joints")} `), group.joints.join(", ")));
      if (starts.length) rows.push(line(made("b", {}, `${words("known")} `), sentence("places_of", starts.join(", "))));
    }
    for (const equation of group.all) {
      if (order === 0 && equation.joint) continue;
      rows.push(...(order ? this.rates(equations, equation, order) : this.closure(equation)));
    }
    if (order === 0 && this.flat) rows.push(...this.meeting(group));
    const unit = ["rad", "rad/s", "rad/s2"][order], value = (letter, low, text) => made("span", { class: "value" }, symbol([letter, low, ""]), ` = ${text}`);
    const values = group.bodies.flatMap((body) => {
      const own = (equations.spins.get(body) || [])[order], low = String(lesson.numbers[body]), letter = ["φ", "ω", "ε"][order];
      if (Number.isFinite(own)) return [value(letter, low, quantity(own, unit, 7))];
      return order && own && own.every(Number.isFinite) ? [value(letter, low, `(${own.map((part) => digits(part, 5)).join("; ")}) ${displayed(unit)[1]}`)] : [];
    });
    if (!this.flat) values.push(...this.coordinates(group, order, value));
    if (values.length) rows.push(made("p", { class: "values" }, made("b", {}, `${words("solved")} `), ...values));
    return rows;
  }

  /** Coordinates of the joints of a spatial group, or their rates. */
  coordinates({ joints }, order, value) {
    const { data, session } = this.app, marks = ["", "\u0307", "\u0308"];
    return data.entries.filter(({ kind, part, columns }) => kind === "joints" && joints.includes(part) && columns.length === 1).flatMap((entry) => {
      const own = session.told(session.pose, entry, order), angle = entry.unit === "rad";
      return own && Number.isFinite(own[0]) ? [value((angle ? "θ" : "s") + marks[order], entry.part, quantity(own[0], rateOf(entry.unit, order), 7))] : [];
    });
  }

  /** Whether a point of a group is held by what is known before it. */
  outside({ reference }, group) {
    return this.app.data.scene.joints.some(({ first, second }) => [first, second].includes(reference) && [first, second].some((own) => !group.bodies.includes(own.split(".")[0])));
  }

  /** r_C = r_B + r_CB. */
  closure({ start, end, arm }) {
    const [factor, unit] = displayed("m"), names = `${end.letter}${start.letter}`;
    const pair = (place) => `(${place.map((value) => digits(value * factor, 5)).join("; ")})`;
    return [made("p", { class: "formula" }, symbol(["r", end.letter]), " = ", symbol(["r", start.letter]), " + ", symbol(["r", names])),
      made("p", { class: "formula numbers" }, `${pair(end.rates[0])} = ${pair(start.rates[0])} + ${pair(arm)} ${unit}`)];
  }

  /** The sentence of two circles, or of a circle and a line, that meet. */
  meeting(group) {
    const arms = group.all.filter(({ joint, start, end }) => !joint && this.outside(start, group) && !(start.letter === end.letter));
    const circles = arms.map(({ start, end, arm }) => ({ about: written(start.letter), through: written(end.letter), radius: quantity(Math.hypot(...arm), "m", 5) }));
    if (circles.length === 2 && circles[0].through === circles[1].through) {
      const [a, b] = circles;
      return [made("p", { class: "meets" }, sentence("circles_meet", a.through, a.about, a.radius, b.about, b.radius))];
    }
    if (circles.length === 1) return [made("p", { class: "meets" }, sentence(group.joints.length > 1 ? "circle_line" : "circle_of", circles[0].through, circles[0].about, circles[0].radius))];
    return [];
  }

  /** An equation of rates in letters, its vectors, and the rate that follows from one of them. */
  rates(equations, equation, order) {
    const right = equations.right(equation, order), whole = equations.whole(equation.end, order), unit = order === 1 ? "m/s" : "m/s2";
    if (!right.length) return [];
    const terms = right.flatMap(({ id, letter }, k) => [k ? " + " : " = ", lightable(made("span", { class: "term" }, symbol(letter)), id)]);
    const rows = [...right, whole].map(({ id, letter, vector, kind }) => this.litRow(id, symbol(letter), quantity(Math.hypot(...vector), unit, this.flat ? 5 : 4), ...(this.flat
      ? [quantity(Math.atan2(vector[1], vector[0]), "rad", 5), this.direction(kind, equation, id === whole.id)] : vector.map((part) => digits(part * displayed(unit)[0], 4)))));
    const head = ["vector", "size", ...(this.flat ? ["direction", "line_of_action"] : "xyz")].map((key) => words(key));
    return [made("p", { class: "formula" }, lightable(made("span", { class: "term" }, symbol(whole.letter)), whole.id), ...terms),
      tableOf(head, rows, this.flat ? "" : "even"), ...(this.flat ? this.follows(equations, equation, order) : [])];
  }

  /** A row of a table whose vector lights up. */
  litRow(id, ...cells) {
    const row = rowOf(...cells);
    row.tabIndex = 0;
    return lightable(row, id);
  }

  direction(kind, { start, end, joint }, last) {
    const arm = written(`${end.letter}${start.letter}`);
    if (last) return "";
    return { relative: sentence("square_to", arm), tangential: sentence("square_to", arm), normal: sentence("from_to", written(end.letter), written(start.letter)),
      sliding: sentence("along_joint", joint), coriolis: sentence("turned_joint", joint), total: words("known") }[kind];
  }

  /** ω = |v_CB| / |r_CB| and what else a size follows by. */
  follows({ spins }, { joint, start, end, arm, terms }, order) {
    const { numbers } = this.app.data.lesson, long = Math.hypot(...arm), size = (kind) => Math.hypot(...((terms[order].find((own) => own.kind === kind) || { vector: [0, 0] }).vector));
    const low = String(numbers[joint ? this.app.data.scene.joints.find(({ name }) => name === joint).first.split(".")[0] : end.body]), names = `${end.letter}${start.letter}`;
    const row = (...parts) => made("p", { class: "formula numbers" }, ...parts);
    if (joint) {
      const turned = size("coriolis");
      return turned > 0 ? [row("|", symbol(["a", names, "k"]), "| = 2·|", symbol(["ω", low]), "|·|", symbol(["v", names, "r"]), `| = ${quantity(turned, "m/s2", 5)}`)] : [];
    }
    const metre = quantity(long, "m", 5), spin = spins.get(end.body) || [];
    if (order === 1) return [row("|", symbol(["ω", low]), "| = |", symbol(["v", names]), "| / |", symbol(["r", names]), `| = ${quantity(size("relative"), "m/s", 5)} / ${metre} = ${quantity(Math.abs(spin[1]), "rad/s", 5)}`)];
    return [row("|", symbol(["a", names, "n"]), "| = ", symbol(["ω", low]), `²·|`, symbol(["r", names]), `| = ${quantity(size("normal"), "m/s2", 5)},  |`, symbol(["ε", low]), "| = |", symbol(["a", names, "τ"]), "| / |", symbol(["r", names]), `| = ${quantity(Math.abs(spin[2]), "rad/s2", 5)}`)];
  }

  /** The vectors of the step at the points they belong to. */
  arrows(equations, group, order) {
    const { diagram } = this.app, drawn = new Set();
    const size = Math.max(0, ...group.all.flatMap((own) => equations.right(own, order)).map(({ vector }) => Math.hypot(...vector)));
    if (!(size > 0)) return;
    for (const equation of group.all) {
      for (const { id, kind, vector } of [...equations.right(equation, order), equations.whole(equation.end, order)]) {
        const long = (LONGEST * Math.hypot(...vector)) / size;
        if (drawn.has(id) || long < 3) continue;
        drawn.add(id);
        const spot = kind === "total" && id === equations.whole(equation.start, order).id ? equation.start : equation.end;
        const [x, y] = diagram.flat(vector), seen = (long * Math.hypot(x, y)) / Math.hypot(...vector);
        if (seen > 1) arrow(lightable(element("g", { class: `vector ${kind}` }, this.layer), id), diagram.at(spot.rates[0]), [x, -y], seen, "");
      }
    }
  }

  /** Circles that points of the group lie on, about points that are known. */
  circles(equations, group) {
    const { diagram } = this.app;
    for (const { joint, start, end, arm } of group.all) {
      if (joint || !this.outside(start, group)) continue;
      const [cx, cy] = diagram.at(start.rates[0]), [x, y] = diagram.at(end.rates[0]);
      if (this.flat) element("circle", { cx, cy, r: Math.hypot(...arm) * diagram.scale, class: "locus" }, this.layer);
      element("path", { d: `M${cx} ${cy}L${x} ${y}`, class: "locus" }, this.layer);
    }
    for (const { name, first, second, axis } of this.flat ? this.app.data.scene.joints : []) {
      const turn = equations.spins.get(first.split(".")[0]), place = equations.places[second];
      if (axis === undefined || !group.joints.includes(name) || !turn || !place) continue;
      const [x, y] = diagram.at(place), [c, s] = [Math.cos(turn[0] + axis), -Math.sin(turn[0] + axis)];
      element("path", { d: `M${x - REACH * c} ${y - REACH * s}L${x + REACH * c} ${y + REACH * s}`, class: "locus" }, this.layer);
    }
  }
}
