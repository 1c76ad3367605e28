/** Fields of what is selected: names, lengths, angles, masses; without a selection parameters, drivers and loads. */
import { bodyOf, driverPaths, isAngle } from "./mechanism.js";
import { find, made, numberIn, typed } from "../made.js";
import { Refused } from "../read_toml.js";
import { sentence, words } from "../words.js";
import { digits, displayed } from "../units.js";

const OF_JOINTS = { axis: "rad", turn: "rad", length: "m", ratio: "", phase: "rad", radius: "m" };
const OF_LOADS = { spring: { stiffness: "N/m", free_length: "m", preload: "N" }, force: { value: "N" }, torque: { value: "N m" }, resistance: { positive: "", negative: "" } };
const WRITTEN_IN = { rad: "_deg", m: "_mm" };

export class Properties {
  /** @param {any} editor */
  constructor(editor) { this.editor = editor; }

  row(label, field, unit = "", more = null) { this.box.append(made("div", { class: "row fields" }, made("label", {}, label), field, made("span", { class: "unit" }, unit), ...(more ? [more] : []))); }

  heading(text) { this.box.append(made("h2", {}, text)); }

  /** A field for text; `act` is a gesture. */
  field(name, value, act, more = {}) {
    const own = made("input", { type: "text", value, "aria-label": name, ...more, onchange: () => { if (own.value !== value) act(own.value); }, onkeydown: (event) => event.stopPropagation() });
    return own;
  }

  /** A field for a number, shown in its unit. */
  number(label, value, unit, act, more = null) {
    const [factor, name] = displayed(unit);
    this.row(label, this.field(`${label}${name ? ` [${name}]` : ""}`, digits(value * factor, 7), (text) => typed(text, (own) => act(own / factor), (about) => this.editor.say(about)), { inputmode: "decimal" }), name, more);
  }

  /** A number of the file, at its place or at a new key. */
  kept(label, path, key, unit, value, strict = false) {
    const { editor } = this;
    this.number(label, value, unit, (own) => editor.edit(() => editor.sketch.numbers.write(editor.sketch.keyed(path, key, WRITTEN_IN[unit] || ""), own), { strict }));
  }

  draw() {
    const { editor } = this, { sketch, selected } = editor;
    this.box = made("div", { class: "fieldset" });
    const node = selected && selected.node && sketch.nodeOf.get(selected.node), body = selected && selected.link && sketch.mechanism.byName.get(selected.link);
    if (node) this.node(node); else if (body) this.link(body); else this.whole();
    find("properties").replaceChildren(this.box);
  }

  button(key, act) { return made("button", { type: "button", onclick: act }, words(key)); }

  node(node) {
    const { editor } = this, { sketch } = editor;
    this.heading(sentence("point_named", node.name));
    this.row(words("name"), this.field(words("name"), node.name, (text) => editor.renamePoint(node, text.trim())));
    [0, 1].forEach((k) => this.number("xy"[k], [node.x, node.y][k], "m", (value) => editor.edit(() => { const to = [node.x, node.y]; to[k] = value; return sketch.move(sketch.nodeOf.get(node.id), to); })));
    for (const joint of sketch.mechanism.joints) if (node.refs.some((reference) => [joint.first, joint.second].includes(reference))) this.joint(joint);
    for (const load of sketch.mechanism.loads) if (load.points.some((reference) => node.refs.includes(reference))) this.load(load);
    this.acts(["pivot", () => editor.edit(() => sketch.pivot(sketch.nodeOf.get(node.id)))], ["delete", () => editor.removeSelected()]);
  }

  acts(...list) { this.box.append(made("div", { class: "acts" }, ...list.map(([key, act]) => this.button(key, act)))); }

  joint(joint) {
    const numbers = Object.keys(OF_JOINTS).filter((key) => joint.drawn && joint[key] !== undefined && !(key === "turn" && joint.kind === "prismatic") && !(key === "ratio" && !joint.places.has("ratio")) && !(key === "radius" && !joint.places.has("radius")));
    if (joint.kind === "curve") this.law(joint);
    for (const key of numbers) this.kept(`${joint.name}: ${words(`of_${key}`)}`, ["joints", joint.name], key, joint.kind === "rack" && key === "phase" ? "m" : OF_JOINTS[key], joint[key], true);
  }

  /** The law of a curve. */
  law({ name, places }) { for (const key of ["x", "y", "roller_radius"]) if (places.has(key)) this.raw(`${name}: ${key === "roller_radius" ? words("of_radius") : key}`, places.get(key), "m", "s"); }

  load(load) {
    const { editor } = this, { sketch } = editor;
    this.heading(`${words(load.kind)} ${load.name}`);
    for (const [key, unit] of Object.entries(OF_LOADS[load.kind] || {})) {
      const place = load.places.get(key), value = place && sketch.toml.get(place.path);
      if (Array.isArray(value)) value.forEach((_, k) => this.raw(`${words(key)} ${"xy"[k] || ""}`, { path: [...place.path, k], suffix: place.suffix }, unit));
      else if (place) this.raw(words(key), place, unit);
    }
    this.acts(["delete", () => editor.edit(() => sketch.removeLoad(load.name))]);
  }

  /** A value as the file has it: a number or an expression; in SI where it has no suffix. */
  raw(label, place, si = "", free = "") {
    const { editor } = this, { sketch } = editor, value = sketch.toml.get(place.path), unit = place.suffix.slice(1) || si;
    this.row(label, this.field(`${label} ${unit}`.trim(), String(value), (text) => {
      const own = numberIn(text), written = Number.isFinite(own) ? String(own) : JSON.stringify(text.trim());
      editor.edit(() => { sketch.toml.set(place.path, written); sketch.mechanism.amount(place, (other) => { if (other === free || other.includes(".")) return sketch.value(other) ?? 1; throw new Refused("no_number", 0, other); }); }, { strict: true });
    }), unit);
  }

  link({ name, mass, inertia, center }) {
    const { editor } = this, { sketch } = editor, path = ["bodies", name];
    this.heading(sentence("link_named", name));
    this.row(words("name"), this.field(words("name"), name, (text) => editor.rename(name, text.trim())));
    for (const side of sketch.lengths(name)) {
      const lock = made("input", { type: "checkbox", checked: side.locked, title: words("about_lock"), "aria-label": sentence("lock_named", side.name), onchange: () => editor.edit(() => sketch.lock(name, side.name)) });
      this.number(side.name, side.value, "m", (value) => editor.edit(() => sketch.resize(side, value), { strict: true }), lock);
    }
    this.number(words("angle"), sketch.frame(name)[2], "rad", (value) => editor.turn(name, value));
    const points = [...sketch.mechanism.pointsOf(name)];
    points.slice(2).forEach(([own, place]) => place.forEach((value, k) => this.number(`${own} ${"xy"[k]}`, value, "m", (next) => editor.edit(() => sketch.numbers.write(sketch.mechanism.places.get(`${name}.${own}`).at[k], next), { strict: true }))));
    this.heading(words("mass_of"));
    this.kept(words("mass"), path, "mass", "kg", mass);
    this.kept(words("inertia"), path, "inertia", "kg m2", inertia);
    center.forEach((value, k) => this.number(`${words("center")} ${"xy"[k]}`, value, "m", (next) => editor.edit(() => {
      const place = sketch.numbers.table(path).get("center");
      if (!place) sketch.toml.set([...path, "center"], "[0, 0]");
      const at = place || { path: [...path, "center"], suffix: "" };
      sketch.numbers.write({ path: [...at.path, k], suffix: at.suffix }, next);
    })));
    for (const joint of sketch.mechanism.joints) if (bodyOf(joint.first) === name && joint.kind !== "revolute") this.joint(joint);
    this.acts(["driver", () => editor.edit(() => sketch.lead(`${name}.angle`))], ["duplicate", () => editor.duplicate(name)], ["delete", () => editor.removeSelected()]);
  }

  whole() {
    const { editor } = this, { sketch } = editor, { mechanism } = sketch;
    this.heading(words("parameters"));
    const table = [...sketch.numbers.table(["parameters"])];
    if (!table.length) this.box.append(made("p", { class: "hint" }, words("first_step")));
    for (const [name, place] of table) this.raw(name, place);
    for (const driver of mechanism.drivers) {
      this.heading(sentence("driver_named", driver.name));
      if (driver.path) this.number(words("speed_of"), driver.speed, isAngle(driver.name) ? "rad/s" : "m/s", (value) => editor.edit(() => this.sped(driver, value)));
    }
    for (const joint of mechanism.joints) if (joint.drawn && (["distance", "rack", "curve"].includes(joint.kind) || joint.ratio)) {
      this.joint(joint);
      this.acts(["delete", () => editor.edit(() => sketch.removeJoint(joint.name))]);
    }
    for (const load of mechanism.loads) this.load(load);
  }

  /** The speed of a driver in all tasks of the drawing. */
  sped({ name }, value) {
    const { sketch } = this.editor, { numbers, toml } = sketch;
    for (const [task, own] of Object.entries(toml.data.tasks || {})) {
      for (const path of own.kind === "modes" ? [] : driverPaths(task, own)) if (toml.get([...path, "coordinate"]) === name) numbers.write(sketch.keyed(path, "speed", ""), value);
    }
  }
}
