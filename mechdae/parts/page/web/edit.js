/** The editor: one machine of states for pointer and keys, the preview, the file. */
import { Diagram } from "./diagram.js";
import { element } from "./view.js";
import { Draft } from "./draft.js";
import { Model } from "./model.js";
import { problemText } from "./toml.js";
import { offered, svgText } from "./files.js";
import { digits } from "./units.js";
import { drawingOf } from "./opened.js";
import { Refused } from "./read_toml.js";
import { words } from "./words.js";
import { Finder } from "./find/find.js";

const TOOLS = ["select", "link", "bar", "pivot", "weld", "slider", "slot", "driver", "delete", "find"];
const NEAR = 12, GRID = 0.005, LARGEST = 200000;
const get = (id) => document.getElementById(id);

class Editor {
  constructor(data) {
    this.given = data;
    this.words = words;
    const [drawing, refused] = data.text ? this.read(data.text, data.name) : [null, ""];
    this.model = new Model(drawing);
    this.svg = get("diagram");
    this.state = { name: "select" };
    this.tool = "select";
    this.value = null;
    this.playing = false;
    this.opened = 0;
    this.diagram = new Diagram(this.svg, { joints: [] }, { parts: [], reach: {}, loads: {} });
    this.over = element("g", {}, this.svg);
    this.buttons();
    this.finder = new Finder(this.diagram, [get("find"), get("found")], words, (drawing) => { this.put(drawing); this.fit(); }, () => this.draw());
    this.fit();
    addEventListener("resize", () => { this.diagram.rect = null; this.diagram.measure(); this.draw(); });
    this.svg.addEventListener("pointerdown", (event) => this.down(event));
    this.svg.addEventListener("pointermove", (event) => this.move(event));
    this.svg.addEventListener("pointerup", (event) => this.up(event));
    this.svg.addEventListener("dblclick", () => { if (this.tool !== "find") this.escape(); });
    document.addEventListener("keydown", (event) => this.key(event));
    document.addEventListener("dragover", (event) => event.preventDefault());
    document.addEventListener("drop", (event) => { event.preventDefault(); if (event.dataTransfer.files.length) this.open(event.dataTransfer.files[0]); });
    this.changed();
    if (refused) { this.message = refused; this.draw(); }
  }

  /** The drawing of a file, or why there is none. @returns {[any, string]} */
  read(text, name) {
    try {
      return [drawingOf(text, this.given.units, name), ""];
    } catch (error) {
      const about = error instanceof Refused ? `${this.words(error.word)}${error.about ? `: ${error.about}` : ""}` : this.words("unreadable");
      return [null, `${name}${error.line ? `, ${this.words("line")} ${error.line}` : ""}: ${about}`];
    }
  }

  buttons() {
    const { words } = this;
    const button = (place, text, act, name = "") => {
      const own = document.createElement("button");
      own.type = "button";
      own.textContent = text;
      if (name) own.dataset.tool = name;
      own.addEventListener("click", act);
      get(place).append(own);
      return own;
    };
    document.title = words("title");
    get("title").textContent = words("title");
    get("subtitle").textContent = words("preview");
    this.toolButtons = TOOLS.map((name) => button("tools", words(name), () => this.choose(name), name));
    button("tools", words("undo"), () => this.undo(true));
    button("tools", words("redo"), () => this.undo(false));
    this.snap = document.createElement("input");
    this.snap.type = "checkbox";
    this.snap.checked = true;
    const label = document.createElement("label");
    label.append(this.snap, ` ${words("grid")}`);
    get("tools").append(label);
    this.play = button("drive", words("play"), () => this.toggle());
    this.slider = document.createElement("input");
    Object.assign(this.slider, { type: "range", min: "0", max: "1", step: "any" });
    this.slider.setAttribute("aria-label", words("driver"));
    this.slider.addEventListener("input", () => { this.at(Number(this.slider.value)); });
    get("drive").append(this.slider);
    const chosen = document.createElement("input");
    Object.assign(chosen, { type: "file", accept: ".toml", hidden: true });
    chosen.addEventListener("change", () => { if (chosen.files.length) this.open(chosen.files[0]); chosen.value = ""; });
    get("files").append(chosen);
    button("files", words("open"), () => chosen.click());
    button("files", "TOML", () => offered("mechanism.toml", this.toml(), "text/plain"));
    button("files", "SVG", () => offered("mechanism.svg", svgText(this.svg), "image/svg+xml"));
    button("files", words("fit"), () => { this.fit(); this.draw(); });
  }

  /** The file that the drawing goes on with: title, lines that are kept, their names. */
  get file() { return this.model.data.file || this.given; }

  /** Put a problem file in the place of the drawing, as one gesture; a file that cannot be read is named and changes nothing. */
  async open(file) {
    const large = file.size > LARGEST ? `${file.name}: ${this.words("too_large")} ${LARGEST / 1000} kB` : "";
    const [drawing, refused] = large ? [null, large] : this.read(await file.text(), file.name);
    this.escape();
    if (drawing) {
      this.put(drawing);
      this.fit();
      this.draw();
    } else {
      this.message = refused;
      this.draw();
    }
    this.opened += 1;
  }

  /** Put a drawing in the place of this one, as one gesture. */
  put(drawing) {
    this.model.data = drawing;
    this.model.done();
    this.changed();
  }

  choose(tool) {
    this.escape();
    this.tool = tool;
    get("find").hidden = get("found").hidden = tool !== "find";
    this.draw();
  }

  /** Back to the state in which nothing has begun. */
  escape() {
    if (this.state.name !== "select") this.model.cancel();
    this.state = { name: "select" };
    this.tool = "select";
    this.changed();
  }

  undo(back) {
    this.state = { name: "select" };
    if (this.model.undo(back)) this.changed();
  }

  key(event) {
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z") {
      event.preventDefault();
      this.undo(!event.shiftKey);
    } else if (event.key === "Escape") this.escape();
  }

  // -- where the pointer is

  fit() {
    const places = [...this.model.data.nodes.map(({ x, y }) => [x, y]), ...(this.tool === "find" ? this.finder.places : [])];
    this.diagram.fit(places.length ? places : [[-0.05, -0.05], [0.25, 0.15]]);
  }

  point(event) { return this.diagram.under(event); }

  nodeAt([x, y], but = null) {
    let best = null, apart = NEAR;
    for (const node of this.model.data.nodes) {
      const [u, v] = this.diagram.at([node.x, node.y]);
      const far = Math.hypot(u - x, v - y);
      if (node.id !== but && far < apart) { apart = far; best = node.id; }
    }
    return best;
  }

  linkAt(place) { return this.lineAt(place, this.model.data.links, ({ nodes }) => nodes); }

  barAt(place) { return this.lineAt(place, this.model.data.bars, ({ ends }) => ends); }

  /** The first of links or bars that has a line under the pointer. */
  lineAt([x, y], list, nodesOf) {
    for (const link of list) {
      const corners = nodesOf(link).map((id) => this.diagram.at([this.model.node.get(id).x, this.model.node.get(id).y]));
      for (let i = 0; i < corners.length; i += 1) {
        for (let j = 0; j < i; j += 1) {
          const [[ax, ay], [bx, by]] = [corners[i], corners[j]];
          const long = (bx - ax) ** 2 + (by - ay) ** 2 || 1;
          const t = Math.min(1, Math.max(0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / long));
          if (Math.hypot(ax + t * (bx - ax) - x, ay + t * (by - ay) - y) < 8) return link.id;
        }
      }
    }
    return null;
  }

  /** Metres, on the grid; beside a node level or upright with it. */
  snapped(place, from = null) {
    let [x, y] = this.diagram.from(place);
    if (this.snap.checked) [x, y] = [x, y].map((v) => Number((Math.round(v / GRID) * GRID).toFixed(6)));
    const base = from === null ? null : this.model.node.get(from);
    if (base) {
      const [u, v] = this.diagram.at([base.x, base.y]);
      if (Math.abs(place[1] - v) < 6) y = base.y;
      if (Math.abs(place[0] - u) < 6) x = base.x;
    }
    return [x, y];
  }

  // -- gestures

  /** The node under the pointer, else a new one there: on a link a point of that link. */
  take(place, from = null) {
    const known = this.nodeAt(place);
    if (known !== null) return known;
    const link = this.linkAt(place);
    const made = this.model.addNode(...this.snapped(place, from));
    if (link !== null) this.model.link(link).nodes.push(made);
    return made;
  }

  down(event) {
    const place = this.point(event);
    if (this.tool === "find") { this.svg.setPointerCapture(event.pointerId); this.finder.down(place); return; }
    const node = this.nodeAt(place), link = this.linkAt(place);
    const { model } = this;
    if (this.tool === "link") {
      if (this.state.name !== "linking") { this.state = { name: "linking", from: this.take(place) }; this.changed(true); return; }
      const { from } = this.state;
      const to = this.take(place, from);
      model.addLink([from, to]);
      model.done();
      this.state = { name: "linking", from: to };
      this.changed();
      return;
    }
    if (this.tool === "bar") {
      const fresh = this.nodeAt(place) === null && link === null;
      const { from } = this.state.name === "barring" ? this.state : { from: null };
      const at = this.take(place, from);
      if (fresh) model.pivot(at); // on nothing a bar stands on the ground
      if (from === null) { this.state = { name: "barring", from: at }; this.changed(true); return; }
      model.addBar(from, at);
      model.done();
      this.state = { name: "select" };
      this.changed();
      return;
    }
    if (this.tool === "slot") {
      if (this.state.name === "slotting" && link !== null && this.state.node !== node) {
        if (model.slot(this.state.node, link)) model.done();
        this.state = { name: "select" };
      } else if (node !== null) this.state = { name: "slotting", node };
      this.changed();
      return;
    }
    if (this.tool === "select") {
      if (node === null) return;
      this.svg.setPointerCapture(event.pointerId);
      this.state = { name: "dragging", node };
      return;
    }
    if (this.tool === "weld") {
      if (node === null || !model.weld(node)) return;
    } else if (this.tool === "delete") model.remove(node !== null ? { node } : link !== null ? { link } : this.barAt(place) !== null ? { bar: this.barAt(place) } : {});
    else if (this.tool === "driver") model.drive(node !== null ? { node } : link !== null ? { link } : {});
    else {
      const at = this.take(place);
      if (this.tool === "pivot") model.pivot(at);
      else model.slider(at, event.shiftKey ? Math.PI / 2 : 0);
    }
    model.done();
    this.changed();
  }

  move(event) {
    const place = this.point(event);
    if (this.tool === "find") this.finder.move(place);
    else if (this.state.name === "dragging") {
      const over = this.nodeAt(place, this.state.node);
      const other = over === null ? null : this.model.node.get(over);
      this.model.move(this.state.node, ...(other ? [other.x, other.y] : this.snapped(place)));
      this.changed(true);
    } else if (this.state.name === "linking" || this.state.name === "barring") {
      this.state.to = place;
      this.draw();
    }
  }

  up(event) {
    if (this.tool === "find") this.finder.up();
    if (this.state.name !== "dragging") return;
    const over = this.nodeAt(this.point(event), this.state.node);
    if (over !== null) this.model.merge(this.state.node, over);
    this.model.done();
    this.state = { name: "select" };
    this.changed();
  }

  // -- preview

  changed(during = false) {
    const { model } = this;
    this.message = "";
    this.draft = new Draft(model.data);
    this.found = this.draft.check();
    this.poses = null;
    this.value = null;
    if (!during && model.data.driver && this.found.count === 1 && this.found.rank === 1) this.poses = this.draft.sweep();
    this.said = this.verdict();
    if (this.poses) {
      const [low, high] = this.span();
      this.slider.value = String((this.draft.begin - low) / (high - low || 1));
    }
    this.draw();
  }

  verdict() {
    const { words, found, model } = this;
    const text = [`${words("count")} ${found.count}, ${words("rank")} ${found.rank}`];
    if (found.without.length) text.push(`${words("pivotless")} ${found.without.join(", ")}`);
    if (!model.data.driver) text.push(words("nodriver"));
    else if (found.count !== 1) text.push(words(found.count > 1 ? "loose" : "stiff"));
    else if (this.poses) {
      const [low, high] = this.poses.ends;
      const turn = model.data.driver.kind === "turn";
      const shown = (end) => (turn ? `${digits((end.u * 180) / Math.PI, 5)}°` : `${digits(1000 * end.u, 5)} mm`);
      text.push(low || high ? `${words("closes")} ${low ? shown(low) : ""} … ${high ? shown(high) : ""}` : words("turns"));
    } else text.push(words("singular"));
    return text.join("; ");
  }

  /** The range of the slider: the poses, and beyond limits some of what does not close. */
  span() {
    const { poses, ends } = this.poses;
    const beyond = this.model.data.driver.kind === "turn" ? 0.3 : 0.05 * this.draft.size;
    return [poses[0].u - (ends[0] ? beyond : 0), poses[poses.length - 1].u + (ends[1] ? beyond : 0)];
  }

  /** Show the preview at a share of the range; beyond a limit what does not close, with the gap. */
  at(share) {
    if (!this.poses) return;
    const [low, high] = this.span();
    this.show(low + share * (high - low));
  }

  show(u) {
    const { poses } = this.poses;
    const near = poses.reduce((best, own) => (Math.abs(own.u - u) < Math.abs(best.u - u) ? own : best));
    const inside = u >= poses[0].u && u <= poses[poses.length - 1].u;
    const solved = inside ? this.draft.solve(near.q, u) : null;
    this.value = solved ? { u, q: solved.q, gap: 0, name: "" } : { u, ...this.draft.open(near.q, u) };
    this.draw();
  }

  toggle() {
    this.playing = !this.playing;
    this.play.textContent = this.words(this.playing ? "pause" : "play");
    let share = Number(this.slider.value), last = performance.now();
    const tick = (now) => {
      if (!this.playing || !this.poses) return;
      share = (share + (now - last) / 5000) % 1;
      last = now;
      this.slider.value = String(share);
      this.at(share);
      requestAnimationFrame(tick);
    };
    if (this.playing) requestAnimationFrame(tick);
  }

  toml() { return problemText(this.model.data, this.file.title, this.file.kept); }

  // -- drawing

  draw() {
    const { draft, diagram, model } = this;
    const q = this.value ? this.value.q : draft.start;
    const { driver } = model.data;
    const driven = driver && driver.kind === "turn" ? model.link(driver.link).name : "";
    if (this.drafted !== draft) {
      this.drafted = draft;
      Object.assign(diagram, draft.scene(DRAWING, draft.start, driven));
      diagram.slid((this.poses ? this.poses.poses : [{ q: draft.start }]).map((pose) => [draft.places(pose.q), draft.angles(pose.q)]));
    }
    diagram.draw(draft.places(q), draft.angles(q));
    this.over.replaceChildren();
    this.svg.append(this.over);
    const single = model.data.nodes.filter((node) => !model.data.links.some(({ nodes }) => nodes.includes(node.id)));
    for (const node of single) {
      const [cx, cy] = diagram.at([node.x, node.y]);
      element("circle", { cx, cy, r: 4, class: "pin" }, this.over);
    }
    if (this.state.name === "linking" || this.state.name === "barring") {
      const node = model.node.get(this.state.from);
      const [x1, y1] = diagram.at([node.x, node.y]);
      element("circle", { cx: x1, cy: y1, r: 6, class: "open" }, this.over);
      if (this.state.to) element("line", { x1, y1, x2: this.state.to[0], y2: this.state.to[1], class: "guide" }, this.over);
    }
    const value = this.value && this.value.gap > 0;
    if (value) {
      const bar = model.data.bars.find(({ name }) => name === this.value.name);
      const names = bar ? bar.ends.map((id) => model.node.get(id).name) : [this.value.name];
      const places = Object.entries(draft.places(q)).filter(([name]) => names.includes(name.split(".")[1])).map(([, place]) => diagram.at(place));
      for (const [cx, cy] of places) element("circle", { cx, cy, r: 7, class: "open" }, this.over);
      for (const [x, y] of places.slice(1)) element("line", { x1: places[0][0], y1: places[0][1], x2: x, y2: y, class: "open" }, this.over);
    }
    if (this.tool === "find") this.finder.draw(this.svg);
    else this.finder.layer.remove();
    for (const own of this.toolButtons) own.setAttribute("aria-pressed", String(own.dataset.tool === this.tool));
    const status = get("status");
    get("kept").textContent = this.file.kept.length ? `${this.words("kept")}: ${this.file.names.join(", ")}` : "";
    status.textContent = this.message ? this.message : value ? `${this.words("gap")} ${this.value.name}: ${digits(1000 * this.value.gap, 4)} mm` : `${this.words(`hint_${this.tool}`)}. ${this.said}`;
    status.className = this.message || value || (model.data.links.length && this.found.count !== 1) ? "warn" : "";
    this.slider.disabled = !this.poses;
    this.play.disabled = !this.poses;
  }
}

const editor = new Editor(JSON.parse(get("mechdae").textContent));
window.mechdae = {
  ready: Promise.resolve(true),
  live: "preview",
  toml: () => editor.toml(),
  state: () => JSON.parse(editor.model.now),
  mobility: () => editor.found,
  opened: () => editor.opened,
  finder: editor.finder,
  values: () => (editor.poses ? editor.poses.poses.map(({ u }) => u) : []),
  set: (u) => { if (!editor.poses) return false; editor.show(u); return editor.value.gap === 0; },
  pose: () => ({ points: editor.draft.places(editor.value ? editor.value.q : editor.draft.start), gap: editor.value ? editor.value.gap : 0 }),
  screen: ([x, y]) => editor.diagram.at([x, y]).map((v) => v * editor.diagram.k),
};
