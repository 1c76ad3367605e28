/** A problem file as a drawing: what the editor draws, and the names of the rest, which is kept as it is. */
import { Refused, readToml } from "./read_toml.js";
import { calculated } from "./arithmetic.js";
import { problemText, KEPT } from "./toml.js";
import { Draft } from "./draft.js";
import { assembled } from "./assembled.js";
import { GROUND_ID } from "./model.js";

const ON_LINE = 1e-9, MOST_LINKS = 100, ATTEMPTS = 40;
const PLAIN_NAME = /^[A-Za-z_]\w*$/;

/** Numbers of a file in SI: parameters, expressions, suffixes of keys. */
class FileNumbers {
  /** @param {any} data tables @param {any} units suffix -> [above, below, pi] */
  constructor(data, units) {
    this.units = units;
    this.given = new Map();
    this.open = new Set();
    for (const table of [data.sizes, data.parameters]) for (const [key, value] of Object.entries(table || {})) { const [name, suffix] = this.split(key); this.given.set(name, [value, suffix]); }
  }

  split(key) {
    const suffix = Object.keys(this.units).filter((own) => key.endsWith(own) && key.length > own.length).sort((a, b) => b.length - a.length)[0] || "";
    return [key.slice(0, key.length - suffix.length), suffix];
  }

  /** Entries of a table by their names without suffixes: [value, suffix]. */
  table(table) { return new Map(Object.entries(table || {}).map(([key, value]) => { const [name, suffix] = this.split(key); return [name, [value, suffix]]; })); }

  named(name) {
    if (!this.given.has(name) || this.open.has(name)) throw new Refused("no_number", 0, name);
    this.open.add(name);
    const value = this.si(...this.given.get(name));
    this.open.delete(name);
    return value;
  }

  si(value, suffix = "") {
    const number = typeof value === "string" ? calculated(value, (name) => this.named(name)) : value;
    if (typeof number !== "number") throw new Refused("no_number", 0, String(value).slice(0, 60));
    if (!suffix) return number;
    const [above, below, pi] = this.units[suffix];
    return pi ? (number * Math.PI * above) / below : (number * above) / below;
  }

  /** The number at a place of the file, which an error names. */
  at(where, value, suffix = "") {
    try { return this.si(value, suffix); } catch (error) {
      if (error instanceof Refused) error.about = `${where}: ${error.about}`;
      throw error;
    }
  }

  points(where, table) {
    const found = new Map(), [points, outer] = this.table(table).get("points") || [{}, ""];
    for (const [name, [place, suffix]] of this.table(points)) {
      if (!PLAIN_NAME.test(name)) throw new Refused("bad_name", 0, `${where}.points.${name}`);
      if (!Array.isArray(place) || place.length !== 2) throw new Refused("no_number", 0, `${where}.points.${name}`);
      found.set(name, place.map((value) => this.at(`${where}.points.${name}`, value, suffix || outer)));
    }
    return found;
  }
}

const entriesOf = (table) => (table && typeof table === "object" && !Array.isArray(table) ? Object.entries(table) : []);
const PINS = ["revolute", "weld"];
const bodyOf = (reference) => reference.split(".")[0];
const pointOf = (reference) => reference.split(".")[1];

class OpenedFile {
  constructor(text, units) {
    const data = readToml(text);
    Object.assign(this, { data, numbers: new FileNumbers(data, units), names: new Set(), of: new Map() });
    if ((data.dimension ?? 2) !== 2) throw new Refused("not_planar");
    this.ground = this.numbers.points("ground", data.ground);
    this.points = new Map(entriesOf(data.bodies).map(([name, own]) => [name, this.numbers.points(`bodies.${name}`, own)]));
    for (const name of this.points.keys()) if (!PLAIN_NAME.test(name) || name === "ground") throw new Refused("bad_name", 0, `bodies.${name}`);
    this.joints = entriesOf(data.joints).map(([name, own]) => this.joint(name, own));
    this.sort();
  }

  joint(name, own) {
    const [first, second] = Array.isArray(own.between) ? own.between.map(String) : ["", ""];
    const table = this.numbers.table(own);
    const number = (key) => this.numbers.at(`joints.${name}.${key}`, ...(table.get(key) || [0, ""]));
    const known = [first, second].every((reference) => reference && this.pointsOf(bodyOf(reference)).has(pointOf(reference)));
    const drawn = known && [...PINS, "prismatic", "pin-in-slot", "distance"].includes(own.kind);
    const [axis, turn, length] = ["axis", "turn", "length"].map((key) => (drawn ? number(key) : 0));
    return { name, kind: own.kind, first, second, drawn: drawn && (own.kind !== "distance" || length > 0), axis, turn, length, keys: [...table.keys()] };
  }

  pointsOf(body) { return (body === "ground" ? this.ground : this.points.get(body)) || new Map(); }

  /** Whether a body is a slider: one point, a guide, else pins alone. */
  isBlock(body) {
    const joints = this.joints.filter(({ first, second }) => [first, second].some((own) => bodyOf(own) === body));
    const used = new Set(joints.flatMap(({ first, second }) => [first, second]).filter((own) => bodyOf(own) === body));
    return used.size === 1 && joints.length > 1 && joints.filter(({ kind }) => kind !== "revolute").length === 1;
  }

  /** The two points of a body that lie on a guide's axis, or null. */
  onAxis({ first, axis }) {
    const points = this.points.get(bodyOf(first)), [x0, y0] = points.get(pointOf(first));
    const [c, s] = [Math.cos(axis), Math.sin(axis)];
    const size = Math.max(...[...points.values()].map(([x, y]) => Math.hypot(x - x0, y - y0)));
    const found = [...points].filter(([, [x, y]]) => Math.abs(c * (y - y0) - s * (x - x0)) <= ON_LINE * size).map(([name]) => name);
    return found.length < 2 ? null : found.slice(0, 2);
  }

  /** Bodies that are links, blocks or not drawn; joints that are drawn. */
  sort() {
    this.blocks = new Set(this.joints.filter((own) => own.kind === "prismatic" && this.isBlock(bodyOf(own.second))).map((own) => bodyOf(own.second)));
    this.links = [...this.points.keys()].filter((name) => !this.blocks.has(name) && this.points.get(name).size > 1);
    this.slots = new Map();
    const held = new Set();
    for (const own of this.joints) {
      if (!own.drawn || [...PINS, "distance"].includes(own.kind)) continue;
      const body = bodyOf(own.first);
      const line = body === "ground" ? [] : this.links.includes(body) && !this.slots.has(body) ? this.onAxis(own) : null;
      const pin = own.kind === "prismatic" ? this.blocks.has(bodyOf(own.second)) : this.links.includes(bodyOf(own.second));
      if (!line || !pin || held.has(own.second)) { own.drawn = false; this.blocks.delete(bodyOf(own.second)); } else if (line.length) this.slots.set(body, line);
      held.add(own.second);
    }
    const known = (reference) => ["ground", ...this.links, ...this.blocks].includes(bodyOf(reference));
    const plain = (reference) => !this.blocks.has(bodyOf(reference)); // a slider of one point has no direction
    for (const own of this.joints) {
      own.drawn = own.drawn && known(own.first) && known(own.second) && (own.kind !== "weld" || (plain(own.first) && plain(own.second)));
      if (own.drawn && PINS.includes(own.kind)) own.drawn = this.root(own.second) !== this.root(own.first); // else one pin twice
      if (own.drawn && PINS.includes(own.kind)) this.of.set(this.root(own.second), this.root(own.first));
    }
    for (const own of this.joints) {
      if (own.drawn && own.kind === "distance") own.drawn = this.root(own.first) !== this.root(own.second) && plain(own.first) && plain(own.second);
    }
  }

  root(reference) {
    let own = reference;
    while (this.of.has(own) && this.of.get(own) !== own) own = this.of.get(own);
    return own;
  }

  /** Nodes by root, in the order in which a file that was saved here has them. */
  nodes() {
    const roots = [], seen = new Set();
    const add = (reference, at = roots.length) => { const root = this.root(reference); if (!seen.has(root)) { seen.add(root); roots.splice(at, 0, root); } return root; };
    for (const own of this.joints) if (own.drawn && own.kind !== "distance") add(PINS.includes(own.kind) ? own.first : own.second);
    const origins = new Map(this.joints.filter(({ kind, first }) => !PINS.includes(kind) && kind !== "distance" && bodyOf(first) === "ground").map((own) => [own.first, own]));
    const touched = new Set(this.joints.flatMap(({ first, second }) => [first, second]));
    let last = -1;
    for (const name of this.ground.keys()) {
      const reference = `ground.${name}`, guide = origins.get(reference);
      const pinned = this.joints.some((own) => own.drawn && [...PINS, "distance"].includes(own.kind) && [own.first, own.second].includes(reference));
      if (!pinned && guide && guide.drawn) last = roots.indexOf(this.root(guide.second));
      else if (pinned || !touched.has(reference)) { add(reference, last + 1); last = roots.indexOf(this.root(reference)); } else this.names.add(`ground.points.${name}`);
    }
    for (const link of this.links) for (const name of this.points.get(link).keys()) add(`${link}.${name}`);
    const taken = new Set([...this.links, ...this.blocks]);
    const first = new Map();
    for (const link of this.links) for (const name of this.points.get(link).keys()) { const root = this.root(`${link}.${name}`); if (!first.has(root)) first.set(root, name); }
    const named = new Map([...first.keys(), ...roots.filter((root) => !first.has(root))].map((root) => {
      const own = first.get(root) || pointOf(root);
      let name = own;
      for (let k = 2; taken.has(name); k += 1) name = `${own}${k}`;
      taken.add(name);
      return [root, name];
    }));
    const fixed = new Map([...this.ground].map(([name, place]) => [this.root(`ground.${name}`), place]));
    return new Map(roots.map((root, k) => {
      const [x, y] = fixed.get(root) || [NaN, NaN];
      return [root, { id: k + 1, name: named.get(root), x, y, fixed: fixed.has(root), slide: null, slot: null, welds: [] }];
    }));
  }

  /** The drawing, at the pose of its sketch. */
  model() {
    const nodes = this.nodes();
    if (!this.links.length || this.links.length > MOST_LINKS) throw new Refused(this.links.length ? "too_many" : "no_links");
    const idOf = (reference) => nodes.get(this.root(reference)).id;
    const links = this.links.map((name, k) => {
      const points = this.points.get(name), order = [...new Set([...(this.slots.get(name) || []), ...points.keys()])];
      const [[x0, y0], [x1, y1]] = order.map((own) => points.get(own));
      const turn = Math.atan2(y1 - y0, x1 - x0), [c, s] = [Math.cos(turn), Math.sin(turn)];
      const locals = order.map((own) => { const [x, y] = points.get(own); return [c * (x - x0) + s * (y - y0), c * (y - y0) - s * (x - x0)]; });
      locals[1] = [turn ? Math.hypot(x1 - x0, y1 - y0) : x1 - x0, 0];
      const ids = order.map((own) => idOf(`${name}.${own}`));
      if (new Set(ids).size !== ids.length) throw new Refused("bad_name", 0, `bodies.${name}`);
      return { id: nodes.size + 1 + k, name, nodes: ids, turn, typed: { locals } };
    });
    const lines = new Map();
    for (const own of this.joints.filter(({ drawn, kind }) => drawn && ["prismatic", "pin-in-slot"].includes(kind))) {
      const node = nodes.get(this.root(own.second)), body = bodyOf(own.first);
      if (body === "ground") { node.slide = { angle: own.axis }; lines.set(node.id, [own.name, this.ground.get(pointOf(own.first))]); } else node.slot = { link: links[this.links.indexOf(body)].id };
    }
    this.weld(nodes, links);
    const bars = this.joints.filter(({ drawn, kind }) => drawn && kind === "distance").map(({ name, first, second, length }, k) =>
      ({ id: nodes.size + links.length + 1 + k, name, ends: [idOf(first), idOf(second)], typed: { length } }));
    const model = { nodes: [...nodes.values()], links, bars, driver: null };
    model.driver = this.driver(model, nodes);
    this.place(model, lines);
    for (const link of links) delete link.turn;
    return model;
  }

  /** Links that are welded at a point, with the turns that were typed. */
  weld(nodes, links) {
    const of = (reference) => links[this.links.indexOf(bodyOf(reference))] || { id: GROUND_ID, turn: 0 };
    for (const { drawn, kind, first, second, turn } of this.joints) {
      if (!drawn || kind !== "weld") continue;
      const { welds } = nodes.get(this.root(second)), [a, b] = [of(first), of(second)];
      const apart = turn + b.turn - a.turn, into = welds.find((own) => own.links.includes(a.id)), from = welds.find((own) => own.links.includes(b.id));
      if (into && !from) { into.links.push(b.id); into.turns.push(into.turns[into.links.indexOf(a.id)] + apart); }
      else if (from && !into) { from.links.push(a.id); from.turns.push(from.turns[from.links.indexOf(b.id)] - apart); }
      else if (!into) welds.push({ links: [a.id, b.id], turns: [0, apart], fresh: true });
      else {
        const shift = into.turns[into.links.indexOf(a.id)] + apart - from.turns[from.links.indexOf(b.id)];
        into.links.push(...from.links);
        into.turns.push(...from.turns.map((own) => own + shift));
        welds.splice(welds.indexOf(from), 1);
      }
    }
    for (const { welds } of nodes.values()) for (const own of welds) if (own.links.indexOf(GROUND_ID) > 0) this.groundFirst(own);
  }

  /** The ground goes first among links that are welded. */
  groundFirst(weld) {
    const at = weld.links.indexOf(GROUND_ID), base = weld.turns[at];
    const order = [at, ...weld.links.keys()].filter((k, i, all) => all.indexOf(k) === i);
    Object.assign(weld, { links: order.map((k) => weld.links[k]), turns: order.map((k) => weld.turns[k] - base) });
  }

  driver(model, nodes) {
    const task = entriesOf(this.data.tasks).map(([, own]) => own.driver || (own.drivers || [])[0]).find((own) => own);
    if (!task) return null;
    const [name, word] = String(task.coordinate).split(".");
    const table = this.numbers.table(task), list = (table.get("at") || [[]])[0];
    const [start, suffix] = Array.isArray(list) && list.length ? [list[0], table.get("at")[1]] : table.get("from") || [0, ""];
    this.begun = { at: Array.isArray(list) && list.length > 0, value: () => this.numbers.at("driver", start, suffix) };
    const pin = this.joints.find((own) => own.name === name && own.drawn && own.kind === "revolute" && bodyOf(own.first) === "ground");
    const link = model.links.find((own) => own.name === (pin ? bodyOf(pin.second) : name));
    if (pin && link) this.pinned = { joint: name, link: link.name };
    if (word === "angle" && link) return { kind: "turn", link: link.id };
    const guide = this.joints.find((own) => own.name === name && own.drawn && own.kind === "prismatic" && bodyOf(own.first) === "ground");
    return word === "slide" && guide ? { kind: "slide", node: nodes.get(this.root(guide.second)).id } : null;
  }

  /** Put nodes and links where the sketch has them; what does not close there is moved until it does. */
  place(model, lines) {
    const sketch = new Map([...this.numbers.table(this.data.sketch)].map(([name, [value, suffix]]) => [name.replace(/\.(angle|slide)$/, ""), this.numbers.at(`sketch.${name}`, value, suffix)]));
    const node = new Map(model.nodes.map((own) => [own.id, own]));
    const { pinned } = this;
    if (pinned && !sketch.has(pinned.link) && sketch.has(pinned.joint)) sketch.set(pinned.link, sketch.get(pinned.joint));
    const driven = model.driver && (model.driver.kind === "turn" ? model.links.find(({ id }) => id === model.driver.link).name : lines.get(model.driver.node)[0]);
    if (driven && (this.begun.at || !sketch.has(driven))) sketch.set(driven, this.begun.value());
    const angles = (k) => model.links.map(({ name, turn }, i) => (sketch.has(name) ? sketch.get(name) + turn : k === null ? null : 2 * Math.PI * (((k + 1) * (i + 1) * 0.618033988749895) % 1)));
    for (let k = 0; k < ATTEMPTS; k += 1) {
      const known = new Map(model.nodes.filter(({ fixed }) => fixed).map(({ id, x, y }) => [id, [x, y]]));
      for (const [id, [name, [x, y]]] of lines) if (sketch.has(name)) known.set(id, [x + sketch.get(name) * Math.cos(node.get(id).slide.angle), y + sketch.get(name) * Math.sin(node.get(id).slide.angle)]);
      const q = this.walked(model, known, angles(null), angles(k));
      const placed = model.nodes.map(({ x, y, ...own }) => { const [u, v] = own.fixed ? [x, y] : lines.has(own.id) ? lines.get(own.id)[1] : known.get(own.id) || [0, 0]; return { ...own, x: u, y: v }; });
      const draft = new Draft({ ...model, nodes: placed });
      draft.frames.forEach((frame, i) => { frame.locals = new Map(model.links[i].nodes.map((id, j) => [id, model.links[i].typed.locals[j]])); });
      draft.start = q;
      const value = driven ? sketch.get(driven) + (model.driver.kind === "turn" ? model.links.find(({ id }) => id === model.driver.link).turn : 0) : null;
      const found = assembled(draft, q, value);
      if (found) { this.settle(model, draft, found, lines); return; }
      if (angles(null).every((own) => own !== null)) break;
    }
    throw new Refused("not_assembled");
  }

  /** Origins and angles of the links, one after the other from points that are known. */
  walked(model, known, given, tried) {
    const q = new Array(3 * model.links.length).fill(null);
    const put = (k, angle) => {
      const { nodes, typed } = model.links[k], [c, s] = [Math.cos(angle), Math.sin(angle)];
      const own = Math.max(0, nodes.findIndex((id) => known.has(id)));
      const [x, y] = known.get(nodes[own]) || [0, 0], [u, v] = typed.locals[own];
      const [ox, oy] = [x - c * u + s * v, y - s * u - c * v];
      q.splice(3 * k, 3, ox, oy, angle);
      typed.locals.forEach(([a, b], j) => { if (!known.has(nodes[j])) known.set(nodes[j], [ox + c * a - s * b, oy + s * a + c * b]); });
    };
    for (let left = model.links.map((_, k) => k); left.length; left = left.filter((k) => q[3 * k] === null)) {
      const anchors = (k) => model.links[k].nodes.flatMap((id, j) => (known.has(id) ? [j] : []));
      const ready = left.find((k) => given[k] !== null && anchors(k).length) ?? left.find((k) => given[k] === null && anchors(k).length > 1);
      const k = ready ?? left.find((own) => anchors(own).length) ?? left[0];
      const [i, j] = anchors(k), { nodes, typed } = model.links[k];
      if (given[k] !== null || j === undefined) put(k, given[k] ?? tried[k]);
      else {
        const way = ([a, b], [c, d]) => Math.atan2(d - b, c - a);
        put(k, way(known.get(nodes[i]), known.get(nodes[j])) - way(typed.locals[i], typed.locals[j]));
      }
    }
    return q;
  }

  /** Write the pose into the drawing, with the numbers that were typed. */
  settle(model, draft, q, lines) {
    const node = new Map(model.nodes.map((own) => [own.id, own]));
    for (const own of model.nodes) {
      const k = model.links.findIndex(({ nodes }) => nodes.includes(own.id));
      if (own.fixed || k < 0) continue;
      [own.x, own.y] = draft.place(q, k, own.id).at;
      const [, [x, y]] = lines.get(own.id) || [0, [Infinity, Infinity]];
      if (Math.hypot(own.x - x, own.y - y) <= ON_LINE * draft.size) [own.x, own.y] = [x, y];
    }
    for (const { welds } of model.nodes) for (const own of welds) delete own.fresh;
    for (const { ends, typed } of model.bars) typed.at = ends.map((id) => [node.get(id).x, node.get(id).y]);
    model.links.forEach((link, k) => {
      const { locals } = link.typed;
      link.typed = { nodes: [...link.nodes], at: link.nodes.map((id) => [node.get(id).x, node.get(id).y]), angle: q[3 * k + 2], locals };
    });
  }

  /** Names of what is not drawn, key by key; `again` is the file as it would be saved. */
  others(again) {
    const { data, names } = this;
    for (const [key, value] of Object.entries(data)) {
      if (["schema", "title", "dimension", "parameters", "ground", "bodies", "joints", "sketch", "tasks"].includes(key)) continue;
      const own = entriesOf(value);
      if (own.length) for (const [name] of own) names.add(`${key}.${name}`);
      else names.add(key);
    }
    for (const key of Object.keys(data.ground || {})) if (this.numbers.split(key)[0] !== "points") names.add(`ground.${key}`);
    for (const [name, own] of entriesOf(data.bodies)) {
      if (!this.links.includes(name) && !this.blocks.has(name)) { names.add(`bodies.${name}`); continue; }
      const known = (again.bodies || {})[name] || {};
      for (const key of Object.keys(own)) if (this.numbers.split(key)[0] !== "points" && !(key === "number" && (this.blocks.has(name) || own[key] === known[key]))) names.add(`bodies.${name}.${this.numbers.split(key)[0]}`);
      if (this.blocks.has(name) && this.points.get(name).size > 1) names.add(`bodies.${name}.points`);
    }
    for (const { name, drawn, keys } of this.joints) {
      if (!drawn) names.add(`joints.${name}`);
      else for (const key of keys) if (!["kind", "between", "axis", "turn", "length"].includes(key)) names.add(`joints.${name}.${key}`);
    }
    for (const [key, value] of entriesOf(data.parameters)) if ((again.parameters || {})[key] !== value) names.add(`parameters.${this.numbers.split(key)[0]}`);
    for (const [name, own] of entriesOf(data.tasks)) if (JSON.stringify((again.tasks || {})[name]) !== JSON.stringify(own)) names.add(`tasks.${name}`);
    return [...names];
  }
}

/** Read a file. @param {string} text @param {any} units @param {string} name of the file @returns {any} the drawing with `file`: title, kept, names */
export function drawingOf(text, units, name) {
  const [own, before] = text.replace(/\r\n/g, "\n").split(`\n${KEPT}\n`);
  const file = new OpenedFile(own, units), model = file.model();
  const title = typeof file.data.title === "string" ? file.data.title : name.replace(/\.toml$/, "");
  const again = readToml(problemText(model, title));
  let names = file.others(again), kept = names.length ? text.trimEnd().split(/\r?\n/) : [];
  if (!names.length && before !== undefined) {
    kept = before.replace(/\n$/, "").split("\n").map((line) => line.replace(/^# ?/, ""));
    names = keysOf(kept.join("\n"), units);
  }
  return { ...model, file: { title, kept, names } };
}

/** What lines that were kept before name. */
function keysOf(text, units) {
  try {
    return new OpenedFile(text.split(`\n${KEPT}\n`)[0], units).others({});
  } catch (error) {
    if (error instanceof Refused) return [KEPT.slice(2, -1)];
    throw error;
  }
}
