/** The editor: a drawing, the tools that change it, and everything that the page shows of what is drawn. */
import { Backdrop } from "./edit/backdrop.js";
import { joined, hanging, opened } from "./edit/closing.js";
import { lightThings } from "./curves.js";
import { Diagram } from "./diagram.js";
import { offered, svgText } from "./files.js";
import { Finder } from "./find/find.js";
import { textOf } from "./edit/given.js";
import { find, made, showFailures, typed } from "./made.js";
import { bodyOf } from "./edit/mechanism.js";
import { Properties } from "./edit/properties.js";
import { Refused } from "./read_toml.js";
import { blank, Sketch } from "./edit/sketch.js";
import { Studies } from "./edit/studies.js";
import { drawnBy, placesOf } from "./edit/symbols.js";
import { Tabs } from "./tabs.js";
import { TOOLS } from "./edit/tools.js";
import { trialOf } from "./edit/trial.js";
import { digits, displayed, quantity, showIn } from "./units.js";
import { element, fromLine } from "./view.js";
import { words } from "./words.js";

/** Units that are shown as files have them: in SI, keys, suffixes with names, the usual one first. */
const MEASURES = [["m", "", { _mm: "mm", _cm: "cm", _in: "in", _ft: "ft" }], ["rad/s", "speed", { _rad_s: "rad/s", _rpm: "rpm", _deg: "°/s", _hz: "turns/s" }]];
const NEAR = 12, BESIDE = 90, LARGEST = 200000, MOST_BODIES = 100;

class Editor {
  constructor(data) {
    Object.assign(this, { data, tool: "select", begun: null, selected: null, message: "", opened: 0, measured: 0.1, playing: false, gap: null });
    this.sketch = new Sketch(blank(words("drawn")), data.units);
    this.name = "mechanism.toml";
    const refused = data.text ? this.taken(data.text, data.name) : "";
    if (!refused) { this.sketch.before = []; this.name = data.name || this.name; }
    this.svg = find("diagram");
    this.diagram = new Diagram(this.svg, { joints: [] }, { parts: [], reach: {}, loads: {} });
    this.backdrop = new Backdrop(this.diagram);
    this.over = element("g", { class: "over" }, this.svg);
    this.properties = new Properties(this);
    this.tabs = new Tabs(find("tabs"), () => { if (this.studies) this.studies.draw(); });
    this.studies = new Studies(this);
    this.finder = new Finder(this.diagram, [find("find"), find("found")], (drawing) => this.put(textOf(drawing, words("drawn"))), () => this.draw());
    lightThings(this.diagram);
    this.controls();
    this.fit();
    this.listen();
    this.changed();
    this.message = refused;
    this.fit(); // with the room that texts and panels leave, and with the paths
    this.draw();
  }

  // -- controls

  controls() {
    document.title = words("title");
    find("title").textContent = words("title");
    find("subtitle").textContent = words("preview");
    const button = (place, key, act, more = {}) => { const own = made("button", { type: "button", title: words(`hint_${key}`) === `hint_${key}` ? "" : words(`hint_${key}`), onclick: act, ...more }, words(key)); find(place).append(own); return own; };
    this.toolButtons = [...Object.keys(TOOLS).filter((name) => name !== "measure"), "find"].map((name) => button("tools", name, () => this.choose(name), { "data-tool": name, "aria-pressed": "false" }));
    button("acts", "undo", () => this.undo(true));
    button("acts", "redo", () => this.undo(false));
    button("acts", "fit", () => { this.fit(); this.draw(); });
    this.grid = made("input", { type: "checkbox", checked: true, onchange: () => this.draw() });
    find("acts").append(made("label", {}, this.grid, ` ${words("grid")}`));
    const start = made("select", { "aria-label": words("template"), onchange: () => { const own = this.data.templates[Number(start.value)]; start.value = ""; if (own) this.begin(own.text, own.name); } },
      made("option", { value: "" }, words("template")), ...this.data.templates.map(({ title }, k) => made("option", { value: k }, title)));
    find("acts").append(start);
    this.play = made("button", { type: "button", onclick: () => this.toggle() }, words("play"));
    this.slider = made("input", { type: "range", min: 0, max: 1, step: "any", "aria-label": words("driver"), oninput: () => this.at(Number(this.slider.value)) });
    this.number = made("input", { type: "text", inputmode: "decimal", "aria-label": words("driver"), size: 8, onchange: () => typed(this.number.value, (value) => { if (this.session) this.show(value / displayed(this.session.motion.way.unit)[0]); }, (text) => this.say(text)) });
    this.unit = made("span", { class: "unit" });
    this.leading = made("select", { "aria-label": words("drivers"), onchange: () => { this.session.along(Number(this.leading.value)); this.studies.draw(); this.draw(); } });
    find("drive").append(this.play, this.slider, this.number, this.unit, this.leading);
    for (const id of ["properties", "curves", "plans", "forces", "file"]) this.tabs.add(id, words(`tab_${id}`), words(`about_panel_${id}`), null);
    const chosen = made("input", { type: "file", accept: ".toml", hidden: true, onchange: () => { if (chosen.files.length) this.open(chosen.files[0]); chosen.value = ""; } });
    const photo = made("input", { type: "file", accept: "image/*", hidden: true, id: "photo-file", onchange: () => { if (photo.files.length) this.photo(photo.files[0]); photo.value = ""; } });
    const files = made("div", { class: "acts", id: "files" }, chosen, photo);
    const opacity = made("input", { type: "range", min: 0, max: 1, step: 0.05, value: 0.5, "aria-label": words("opacity"), oninput: () => this.backdrop.image.setAttribute("opacity", opacity.value) });
    const known = made("input", { type: "text", inputmode: "decimal", value: "100", size: 6, "aria-label": `${words("known_length")} [mm]`, onchange: () => typed(known.value, (value) => { this.measured = value / 1000; }, (text) => this.say(text)) });
    find("file").append(files, made("h2", {}, words("photo")), made("div", { class: "acts", id: "photo" }), made("p", { class: "hint" }, words("about_photo")), made("p", { id: "kept", class: "hint" }));
    button("files", "open", () => chosen.click());
    button("files", "save", () => offered(this.name, this.sketch.text, "text/plain"));
    button("files", "picture", () => offered("mechanism.svg", svgText(this.svg), "image/svg+xml"));
    button("photo", "photo", () => photo.click());
    find("photo").append(made("label", {}, words("opacity"), opacity), made("label", {}, words("known_length"), known, " mm"));
    button("photo", "measure", () => this.choose("measure"), { "data-tool": "measure" });
  }

  listen() {
    new ResizeObserver(() => { this.diagram.rect = null; this.diagram.measure(); this.draw(); this.studies.draw(); }).observe(this.svg);
    const place = (event) => this.snapped(event);
    this.svg.addEventListener("pointerdown", (event) => this.down(event, place(event)));
    this.svg.addEventListener("pointermove", (event) => this.move(event, place(event)));
    this.svg.addEventListener("pointerup", (event) => this.up(event, place(event)));
    this.svg.addEventListener("dblclick", () => { if (this.tool !== "find") this.escape(); });
    this.svg.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(event, 1.0015 ** -event.deltaY); }, { passive: false });
    document.addEventListener("keydown", (event) => this.key(event));
    document.addEventListener("dragover", (event) => event.preventDefault());
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      const [file] = event.dataTransfer.files;
      if (file) { if (file.type.startsWith("image/")) this.photo(file); else this.open(file); }
    });
  }

  key(event) {
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z") {
      event.preventDefault();
      this.undo(!event.shiftKey);
    } else if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "d" && this.selected && this.selected.link) {
      event.preventDefault();
      this.duplicate(this.selected.link);
    } else if (event.key === "Escape") this.escape();
    else if (event.key === "Delete" && document.activeElement === this.svg && this.selected) this.removeSelected();
  }

  /** A copy of a link, which is selected then. */
  duplicate(link) {
    this.edit(() => {
      const frames = this.sketch.copied(link);
      [[this.selected.link]] = frames;
      return frames;
    });
  }

  removeSelected() { this.remove({ node: this.sketch.nodeOf.get(this.selected.node), link: this.selected.link }); }

  remove({ node, link, stroke }) {
    this.begun = null; // also a drag of it
    this.edit(() => (node ? this.sketch.removeNode(node) : link ? this.sketch.removeBody(link) : this.removeStroke(stroke)));
    this.select(null);
  }

  choose(tool) {
    this.begun = null;
    this.tool = tool;
    find("find").hidden = find("found").hidden = tool !== "find";
    this.say("");
  }

  /** End what has begun: the tool stays, and what was made stays. */
  escape() {
    const lone = this.tool === "link" && this.begun && !this.begun.node;
    if (this.begun && this.begun.dragged) this.sketch.done();
    this.begun = null;
    this.say(lone ? words("lone_point") : "");
  }

  undo(back) {
    this.begun = null;
    if (this.sketch.undo(back)) this.changed();
  }

  // -- gestures

  /** Change the drawing; what is refused is said and changes nothing. @param {() => any} act */
  edit(act, options = {}) {
    this.message = "";
    try {
      this.sketch.change(act, options);
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      this.message = this.reason(error);
    }
    this.changed(options.during);
  }

  reason(error) { return `${words(error.word)}${error.about ? `: ${error.about}` : ""}`; }

  refuse(word, about = "") { this.say(this.reason(new Refused(word, 0, about))); }

  say(text) {
    this.message = text;
    this.draw();
  }

  rename(old, name) { this.edit(() => { this.sketch.rename(old, name); this.selected = { link: name }; }); }

  renamePoint(node, name) {
    this.edit(() => {
      for (const reference of node.refs) this.sketch.rename(node.name, name, bodyOf(reference));
      this.selected = { node: `${bodyOf(node.id)}.${name}` };
    });
  }

  /** Turn the drawing until a link has an angle. */
  turn(body, angle) {
    this.edit(() => {
      const { sketch } = this, { rows, q } = sketch.pose, row = rows.coordinate(`${body}.angle`), now = sketch.frame(body)[2];
      const to = now + Math.atan2(Math.sin(angle - now), Math.cos(angle - now)), found = joined([...rows.joints, row], q, [...rows.joints.map(() => 0), to]);
      if (!found.shut) throw new Refused("does_not_close", 0, body);
      return new Map(sketch.mechanism.bodies.map(({ name }, k) => [name, [found.q[3 * k] * rows.size, found.q[3 * k + 1] * rows.size, found.q[3 * k + 2]]]));
    });
  }

  // -- files

  /** Put a text in the place of the drawing; why it cannot be, or "". */
  taken(text, name) {
    const { sketch } = this, before = sketch.text;
    try {
      sketch.load(text.replace(/^\uFEFF/, "").replace(/\r\n/g, "\n"));
      const { bodies } = sketch.mechanism;
      if (!bodies.length || bodies.length > MOST_BODIES) throw new Refused(bodies.length ? "too_many" : "no_links");
      if (!sketch.pose.shut) throw new Refused("not_assembled");
      sketch.done();
      this.measures(text);
      return "";
    } catch (error) {
      sketch.load(before);
      const about = error instanceof Refused ? this.reason(error) : words("unreadable");
      return `${name}${error.line ? `, ${words("line")} ${error.line}` : ""}: ${about}`;
    }
  }

  /** Show lengths and angular speeds in the units that a file has most. */
  measures(text) {
    for (const [unit, key, names] of MEASURES) {
      const counted = Object.keys(names).map((suffix) => [suffix, text.split(new RegExp(`${key}${suffix}\\b`)).length]), [suffix] = counted.reduce((best, own) => (own[1] > best[1] ? own : best));
      showIn({ [unit]: [1 / this.sketch.numbers.unit(suffix), names[suffix]] });
    }
  }

  /** A text in the place of the drawing, as one gesture. */
  begin(text, name) {
    this.choose("select");
    this.selected = null;
    const refused = this.taken(text, name);
    this.changed();
    if (refused) this.message = refused;
    else { this.name = name; this.fit(); }
    this.draw();
  }

  /** A text that was found in the place of the drawing, as one gesture; the tool stays. */
  put(text) {
    this.message = this.taken(text, this.name);
    this.changed();
    this.fit();
    this.draw();
  }

  async open(file) {
    if (file.size > LARGEST) { this.choose("select"); this.say(`${file.name}: ${words("too_large")} ${LARGEST / 1000} kB`); } else this.begin(await file.text(), file.name);
    this.opened += 1;
  }

  photo(file) {
    const reader = new FileReader(), image = new Image();
    reader.onload = () => { image.src = String(reader.result); };
    image.onload = () => { this.backdrop.put(image.src, image.height / image.width); this.draw(); };
    image.onerror = () => this.refuse("unreadable", file.name);
    reader.readAsDataURL(file);
  }

  // -- where the pointer is

  fit() {
    Object.assign(this.diagram, { zoomed: [1, 0, 0], rect: null });
    const { places, angles } = placesOf(this.sketch, this.sketch.pose.q), known = [...Object.values(places), ...this.diagram.extent(places, angles)], tracks = this.session ? this.session.poses.filter(({ y }) => y).flatMap((pose) => Object.values(this.session.places_of(pose))) : [];
    this.diagram.fit(known.length > 1 ? [...known, ...tracks] : [[-0.05, -0.05], [0.25, 0.15]]);
    if (this.trial) { Object.assign(this.diagram, drawnBy(this.sketch, DRAWING, this.diagram.scale)); this.slide(); } // letters for this scale
  }

  zoom(event, times) {
    this.diagram.zoom(times, this.diagram.under(event));
    this.draw();
  }

  pan(begun) {
    this.diagram.pan(begun.now[0] - begun.from[0], begun.now[1] - begun.from[1]);
    begun.from = begun.now;
    this.draw();
  }

  nearNode(event, but = null) {
    const [x, y] = this.diagram.under(event);
    let best = null, apart = NEAR;
    for (const node of this.sketch.nodes) {
      const [u, v] = this.diagram.at([node.x, node.y]), far = Math.hypot(u - x, v - y) + (node.fixed && node.refs.length < 2 ? 3 : 0); // links go before points of guides
      if (!node.refs.includes(but) && far < apart) { apart = far; best = node; }
    }
    return best;
  }

  /** Distance in units of the sheet from a line between two places of the drawing. */
  away(under, a, b) { return fromLine(under, this.diagram.at(a), this.diagram.at(b)); }

  /** The link nearest to a place of the sheet, at most so far. */
  linkNear(under, most) {
    let best = null, apart = most;
    for (const { name, points } of this.sketch.links) {
      const corners = [...points.keys()].map((own) => this.sketch.place(`${name}.${own}`));
      corners.forEach((a, i) => corners.slice(0, i).forEach((b) => { const far = this.away(under, a, b); if (far < apart) { apart = far; best = name; } }));
    }
    return best;
  }

  nearestLink(place) { return this.linkNear(this.diagram.at(place), BESIDE) || (this.selected && this.selected.link) || null; }

  /** A bar, cylinder, guide or spring under the pointer. */
  strokeNear(under) {
    const { joints, loads } = this.sketch.mechanism;
    const lines = [...joints.filter(({ drawn, kind }) => drawn && ["distance", "prismatic"].includes(kind)).map((joint) => ({ joint, ends: [joint.first, joint.second] })), ...loads.filter(({ points }) => points.length === 2).map((load) => ({ load, ends: load.points }))];
    return lines.find(({ ends: [a, b] }) => this.away(under, this.sketch.place(a), this.sketch.place(b)) < 8) || null;
  }

  removeStroke({ joint, load }) {
    if (load) this.sketch.removeLoad(load.name);
    else if (bodyOf(joint.first) !== "ground" && joint.kind === "prismatic") for (const own of [joint.first, joint.second]) this.sketch.removeBody(bodyOf(own));
    else this.sketch.removeJoint(joint.name);
  }

  /** Metres, on the grid; from a point on level or upright with it. */
  snapped(event) {
    const under = this.diagram.under(event), [x, y] = this.diagram.from(under), { step } = this.backdrop;
    let place = this.grid.checked ? [x, y].map((value) => Number((Math.round(value / step) * step).toPrecision(9))) : [x, y];
    const from = this.begun && (this.begun.node ? [this.begun.node.x, this.begun.node.y] : this.begun.place);
    if (from) { const [u, v] = this.diagram.at(from); place = [Math.abs(under[0] - u) < 6 ? from[0] : place[0], Math.abs(under[1] - v) < 6 ? from[1] : place[1]]; }
    return place;
  }

  // -- pointer

  down(event, place) {
    if (event.button) return;
    this.svg.setPointerCapture(event.pointerId);
    if (this.tool === "find") { this.finder.down(this.diagram.under(event)); return; }
    this.svg.focus({ preventScroll: true });
    this.message = "";
    this.shift = event.shiftKey;
    this.toStart();
    const under = this.diagram.under(event), node = this.nearNode(event), link = node ? null : this.linkNear(under, 8);
    this.strokeUnder = this.strokeNear(under);
    this.pressed = under;
    TOOLS[this.tool].down(this, { node, link, place }, event);
    this.draw();
  }

  move(event, place) {
    const { begun } = this;
    if (this.tool === "find") this.finder.move(this.diagram.under(event));
    if (!begun) return;
    begun.to = place;
    begun.now = this.diagram.under(event);
    if (this.pressed && Math.hypot(begun.now[0] - this.pressed[0], begun.now[1] - this.pressed[1]) > 3) begun.moved = true;
    if (this.pressed && begun.moved && TOOLS[this.tool].move) TOOLS[this.tool].move(this, place, event);
    else this.draw();
  }

  up(event, place) {
    this.pressed = null;
    if (this.tool === "find") this.finder.up();
    if (this.begun && TOOLS[this.tool].up) TOOLS[this.tool].up(this, place, event);
    if (this.tool === "select") this.begun = null;
    this.draw();
  }

  /** Back to the pose that is drawn, before it is changed. */
  toStart() {
    if (this.playing) this.toggle();
    if (this.session && this.tool !== "measure") { this.session.drive(this.session.data.start.s); this.gap = null; }
  }

  select(what) {
    this.selected = what;
    if (what) this.studies.follow(what.node ? { node: this.sketch.nodeOf.get(what.node) } : what);
    this.properties.draw();
    this.studies.draw();
    this.draw();
  }

  // -- what is drawn, solved

  changed(during = false) {
    const { sketch } = this;
    if (this.selected && !(this.selected.node ? sketch.nodeOf.has(this.selected.node) : sketch.mechanism.byName.has(this.selected.link))) this.selected = null;
    this.gap = null;
    this.freedom = sketch.mechanism.bodies.length ? sketch.freedom : { count: 0, rank: 0, without: [] };
    Object.assign(this.diagram, drawnBy(sketch, DRAWING, this.diagram.scale));
    this.trial = during ? { session: null, reason: "" } : trialOf(sketch);
    this.session = this.trial.session;
    this.slide();
    if (!during) {
      this.studies.take(this.session);
      this.properties.draw();
      const { drivers } = sketch.mechanism;
      this.leading.replaceChildren(...drivers.map(({ name }, k) => made("option", { value: k }, name)));
      this.leading.hidden = drivers.length < 2;
      this.studies.draw();
    }
    this.draw();
  }

  /** How far guides reach, over all poses. */
  slide() {
    const poses = this.session ? this.session.poses.filter(({ x }) => x).map((pose) => placesOf(this.sketch, pose.x)) : [placesOf(this.sketch, this.sketch.pose.q)];
    this.diagram.slid(poses.map(({ places, angles }) => [places, angles]));
  }

  get turning() { return this.session && this.session.motion.way.unit === "rad"; }

  /** Where the driver can be shown: its range, and beyond limits some of what does not close. */
  get span() {
    const { range, motion } = this.session, beyond = this.turning ? 0.3 : 0.05 * this.sketch.mechanism.size;
    return [range[0] - (motion.ends[0] ? beyond : 0), range[1] + (motion.ends[1] ? beyond : 0)];
  }

  at(share) {
    if (!this.session) return;
    const [low, high] = this.span;
    this.show(low + share * (high - low));
  }

  /** Show a value of the driver; beyond a limit what does not close, with the gap. */
  show(s) {
    const { session, sketch } = this, ok = session.drive(s);
    const u = session.data.drivers ? null : [s], near = session.poses.filter(({ x }) => x).reduce((best, own) => (Math.abs(own.s - s) < Math.abs(best.s - s) ? own : best));
    this.gap = ok || !u ? null : opened(sketch.pose, Array.from(near.x), u);
    this.draw();
    return ok;
  }

  toggle() {
    this.playing = !this.playing && Boolean(this.session);
    this.play.textContent = words(this.playing ? "pause" : "play");
    let last = performance.now(), sense = 1;
    const tick = (now) => {
      if (!this.playing || !this.session) return;
      const [low, high] = this.session.range, round = this.turning && !this.session.motion.ends[0];
      let s = this.session.s + (sense * (Math.max(now - last, 0) * (high - low))) / 5000;
      last = now;
      if (s > high || s < low) { if (round) s = low + (s - high); else { sense = -sense; s = Math.min(Math.max(s, low), high); } }
      this.show(s);
      requestAnimationFrame(tick);
    };
    if (this.playing) requestAnimationFrame(tick);
  }

  /** What is said of the mobility and of the way of the driver. */
  get said() {
    const { sketch, freedom, session, trial } = this, { mechanism } = sketch, text = [];
    if (!mechanism.bodies.length && !mechanism.ground.size) return words("first_step");
    if (mechanism.bodies.length) text.push(`${words("count")} ${freedom.count}, ${words("rank")} ${freedom.rank}`);
    const loose = hanging(mechanism), { stray } = sketch;
    if (loose.length) text.push(`${words("hanging")} ${loose.join(", ")}`);
    if (stray.length) text.push(`${words("stray")} ${stray.join(", ")}`);
    if (freedom.without.length) text.push(`${words("pivotless")} ${freedom.without.join(", ")}`);
    if (session) {
      const { range, motion: { ends, way } } = session, shown = (end, value) => (end ? quantity(value, way.unit, 5) : "");
      text.push(ends[0] || ends[1] ? `${words("closes")} ${shown(ends[0], range[0])} … ${shown(ends[1], range[1])}` : words("turns"));
      text.push(this.studies.efforts());
      if (trial.rubs) text.push(words("without_friction"));
    } else if (trial.reason && trial.reason !== "empty") text.push(`${words(trial.reason)}${trial.reason === "open" ? ` ${sketch.pose.open}` : ""}`);
    return text.filter(Boolean).join("; ");
  }

  /** Places, angles and the pose that are shown. */
  get shown() {
    const { session, sketch, gap } = this, pose = session && session.pose;
    return placesOf(sketch, gap ? gap.q : pose && pose.x ? Array.from(pose.x) : sketch.pose.q);
  }

  draw() {
    const { diagram, session, sketch, gap } = this, { places, angles } = this.shown;
    sketch.seen = diagram.size[0] / diagram.scale;
    this.backdrop.draw(this.grid.checked);
    const traced = session ? session.data.entries.filter(({ kind, part }) => kind === "points" && this.traces(part)) : [];
    diagram.traces(traced.map(({ columns }) => session.poses.map((pose) => (pose.y ? columns.map((k) => pose.y[0][k]) : null))));
    diagram.draw(places, angles);
    this.svg.append(this.over);
    this.marks(places);
    if (this.tool === "find") this.finder.draw(this.svg);
    else this.finder.layer.remove();
    for (const own of document.querySelectorAll("[data-tool]")) own.setAttribute("aria-pressed", String(own.dataset.tool === this.tool));
    const rest = sketch.mechanism.rest;
    find("kept").textContent = rest.length ? `${words("kept")}: ${rest.join(", ")}` : "";
    const status = find("status"), text = this.message || (gap ? `${words("gap")} ${gap.name}: ${quantity(gap.gap, "m", 4)}` : `${words(`hint_${this.tool}`)}. ${this.said}`);
    if (status.textContent !== text) status.textContent = text;
    status.className = this.message || gap || (sketch.mechanism.bodies.length && !session) ? "warn" : "";
    for (const own of [this.slider, this.play, this.number]) own.disabled = !session;
    if (!session) return;
    const [low, high] = this.span, [factor, unit] = displayed(session.motion.way.unit);
    this.unit.textContent = unit;
    if (document.activeElement !== this.slider) this.slider.value = String((session.s - low) / (high - low));
    if (document.activeElement !== this.number) this.number.value = digits(Math.round(1e9 * session.s * factor) / 1e9, 7);
    this.studies.mark();
  }

  /** Whether the path of a point is drawn: of the selected one, else of points that are no joints. */
  traces(part) {
    const node = this.sketch.nodeOf.get(part), { selected } = this;
    if (!node || node.fixed || node.refs[0] !== part) return false;
    return selected && selected.node ? selected.node === node.id : node.refs.length === 1 || selected?.link === bodyOf(part);
  }

  /** What is selected or begun, and the gap beyond a limit. */
  marks(places) {
    const { diagram, begun, gap, selected, sketch } = this;
    this.over.replaceChildren();
    const ring = (place, r, kind = "open") => { const [cx, cy] = diagram.at(place); element("circle", { cx, cy, r, class: kind }, this.over); };
    const line = (a, b, kind) => { const [[x1, y1], [x2, y2]] = [a, b].map((place) => diagram.at(place)); element("line", { x1, y1, x2, y2, class: kind }, this.over); };
    if (selected && selected.node) ring(places[sketch.nodeOf.get(selected.node).id], 9, "chosen");
    if (selected && selected.link) for (const own of sketch.mechanism.pointsOf(selected.link).keys()) ring(places[`${selected.link}.${own}`], 9, "chosen");
    if (begun && !begun.dragged && !begun.panned) {
      const from = begun.node ? [begun.node.x, begun.node.y] : begun.place;
      ring(from, 6);
      if (begun.to) {
        line(from, begun.to, "guide");
        const [x, y] = diagram.at(begun.to), long = Math.hypot(begun.to[0] - from[0], begun.to[1] - from[1]), angle = Math.atan2(begun.to[1] - from[1], begun.to[0] - from[0]);
        element("text", { x: x + 10, y: y - 8, class: "measure" }, this.over).textContent = `${quantity(long, "m", 4)} ${quantity(angle, "rad", 3)}`;
      }
    }
    if (!gap) return;
    const joint = sketch.mechanism.joints.find(({ name }) => name === gap.name), ends = joint ? [places[joint.first], places[joint.second]] : [];
    for (const own of ends) ring(own, 7);
    if (ends.length) line(ends[0], ends[1], "open");
  }
}

showFailures();
const editor = new Editor(JSON.parse(find("mechdae").textContent));
window.mechdae = {
  ready: Promise.resolve(true),
  get live() { return Boolean(editor.session); },
  toml: () => editor.sketch.text,
  state: () => {
    const { nodes, mechanism, text } = editor.sketch;
    return { text, nodes: nodes.map(({ id, name, x, y, fixed, refs }) => ({ id, name, x, y, fixed, refs })), links: mechanism.bodies.map(({ name, points }) => ({ name, points: [...points.keys()] })), joints: mechanism.joints.map(({ name, kind }) => [name, kind]), drivers: mechanism.drivers.map(({ name }) => name), tool: editor.tool, selected: editor.selected };
  },
  finder: editor.finder,
  mobility: () => editor.freedom,
  opened: () => editor.opened,
  values: () => (editor.session ? editor.session.poses.filter(({ status }) => status === "ok").map(({ s }) => s) : []),
  set: (s) => Boolean(editor.session) && editor.show(s),
  lead: (u) => Boolean(editor.session) && editor.session.move(u) === 1 && (editor.draw(), true),
  pose: () => {
    const { session } = editor, pose = session && session.pose, forces = session && session.forcesAt(pose);
    const outputs = session && pose.y ? Object.fromEntries(session.data.entries.flatMap(({ kind, part, names, columns }) => names.map((name, order) => [`${kind}/${part}/${name}`, session.inTime(pose, columns, order)]))) : {};
    return { points: editor.shown.places, gap: editor.gap ? editor.gap.gap : 0, outputs, forces, bound: pose && pose.error ? session.motion.bound(pose) : null };
  },
  screen: (place) => editor.diagram.at(place).map((value) => value * editor.diagram.k),
};
