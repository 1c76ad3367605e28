/** Curves, plans and forces of what is drawn: the panels of the page over the session of the drawing. */
import { Balance } from "../balance.js";
import { Curves, forceThings, thingsOf } from "../curves.js";
import { find } from "../made.js";
import { Plans } from "../plans.js";
import { quantity } from "../units.js";
import { Values } from "../values.js";
import { sum } from "../vectors.js";
import { words } from "../words.js";

const SILENT = 1e-9;

/** The balance of a link where loads, inertia and the drive are one force: that which closes its plan. */
class Closed extends Balance {
  acting({ data }) {
    const rest = (body) => sum([0, 0], ...this.on(body).map(({ force }) => force)).map((value) => -value);
    return data.scene.bodies.map(({ name: body }) => ({ id: `rest/${body}`, kind: "inner", body, letter: ["F", String(this.lesson.numbers[body] ?? body), ""], force: rest(body), couple: 0 }));
  }
}

/** What the panels of the page ask of it, for one session. */
class Study {
  constructor(editor, session) { Object.assign(this, { editor, session, data: session.data }); }

  /** Numbers are written in every frame. */
  get reading() { return true; }

  along() { const { way } = this.session.motion; return { places: this.session.places, way: { name: way.name, unit: way.unit }, events: [] }; }

  want({ s }) { this.editor.show(s); }

  balance() {
    const { session } = this, { pose } = session, forces = session.forcesAt(pose);
    return forces && new Closed(session, { places: session.places_of(pose) }, forces);
  }

  /** Images of all points about the pole; those of a link of three and more are a polygon. */
  equations() {
    const { session, data } = this, { pose } = session, moving = (order) => pose.y && Number.isFinite(pose.y[order][0]);
    const plan = (order) => {
      const images = data.entries.filter(({ kind }) => kind === "points").map(({ part, columns }) => ({ part, at: session.inTime(pose, columns, order) }));
      const size = Math.max(...images.map(({ at }) => Math.hypot(...at)));
      if (!(size >= 0)) return null;
      const same = (one, two) => Math.hypot(one[0] - two[0], one[1] - two[1]) < 1e-6 * size, ends = [{ text: order === 1 ? "p" : "π", at: [0, 0] }], arrows = [], lines = [], symbol = order === 1 ? "v" : "a";
      for (const { part, at } of images) {
        const letter = data.lesson.letters[part], small = letter.charAt(0).toLowerCase() + letter.slice(1), known = ends.find((own) => same(own.at, at));
        if (known) { if (known.at[0] || known.at[1]) known.text = [...new Set([...known.text.split(", "), small])].join(", "); continue; }
        ends.push({ text: small, at });
        if (Math.hypot(...at) > SILENT * size) arrows.push({ id: `thing-${part}`, kind: "total", from: [0, 0], to: at, letter: [symbol, letter, ""] });
      }
      for (const { name } of data.scene.bodies) {
        const own = images.filter(({ part }) => part.startsWith(`${name}.`)).map(({ at }) => at);
        own.forEach((at, k) => { if (k || own.length > 2) lines.push([at, own[(k || own.length) - 1]]); });
      }
      return { arrows, lines, ends, unit: order === 1 ? "m/s" : "m/s2" };
    };
    return { rated: moving(1), plan };
  }
}

export class Studies {
  /** @param {any} editor */
  constructor(editor) {
    this.editor = editor;
    this.panels = [];
  }

  /** Use another session, or none; what was chosen is chosen again. */
  take(session) {
    const chosen = this.curves ? this.curves.chosen.map(({ parts }) => parts[0]) : [], plan = this.plans && this.plans.choice.value;
    for (const id of ["curves", "plans", "forces"]) find(id).replaceChildren();
    Object.assign(this, { session, curves: null, plans: null, panels: [] });
    if (!session) return;
    const study = new Study(this.editor, session), things = thingsOf(study), again = things.filter(({ parts }) => parts.some((part) => chosen.includes(part)));
    const free = things.filter(({ kind, parts }) => kind === "points" && parts.length === 1);
    this.curves = new Curves(study, "curves", things, again.length ? again : [free[0] || things.find(({ kind }) => kind === "points") || things[0]]);
    this.plans = new Plans(study, () => this.draw());
    if (plan && [...this.plans.choice.options].some(({ value }) => value === plan)) this.plans.choice.value = plan;
    this.panels = [["curves", this.curves], ["curves", new Values(study, "curves")], ["plans", this.plans]];
    if (session.forces) {
      const acting = forceThings(study);
      this.panels.push(["forces", new Curves(study, "forces", acting, acting.slice(0, 2))], ["forces", new Values(study, "forces")]);
    }
  }

  /** Curves of a node or a link. */
  follow({ node, link }) {
    const thing = this.curves && this.curves.things.find(({ kind, parts }) => (node ? kind === "points" && parts.some((part) => node.refs.includes(part)) : kind === "bodies" && parts.includes(link)));
    if (thing) this.curves.chosen = [thing];
  }

  shown() { return this.panels.filter(([id]) => id === this.editor.tabs.shown).map(([, panel]) => panel); }

  draw() {
    for (const panel of this.shown()) if (panel.whole) panel.whole();
    this.mark();
  }

  /** The pose that is shown, in curves and plans. */
  mark() {
    const { session } = this;
    if (session) for (const panel of this.shown()) panel.frame(session.pose, session.forcesAt(session.pose));
  }

  /** Efforts of the pose that is shown, in words. */
  efforts() {
    const forces = this.session && this.session.forces && this.session.forcesAt(this.session.pose);
    return forces ? Object.entries(forces.efforts).map(([name, value]) => `${words("effort")} ${name} ${quantity(value, this.session.data.forces.units[name], 5)}`).join(", ") : "";
  }
}
