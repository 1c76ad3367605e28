/** The page: reads its data, makes the controls, draws when something changed. */
import { words } from "./words.js";
import { bareAngle, Session } from "./session.js";
import { Recorded } from "./recorded.js";
import { Chart, ticks } from "./chart.js";
import { isWhole } from "./whole.js";
import { digits, displayed, nameIn, quantity, rounded, showIn } from "./units.js";
import { Plans } from "./plans.js";
import { Several } from "./several.js";
import { pulled, slidersAt } from "./shape.js";
import { csvText, offered, png, svgText, tomlText } from "./files.js";

/** Milliseconds that a change may take to be drawn whole in each frame. */
const FRAME = 12;
/** Poses whose wheels and guides the picture has to hold. */
const FEW = 12;

const find = (id) => document.getElementById(id);

/** An HTML element with attributes and children; texts are texts, never markup. */
function made(name, attributes = {}, ...children) {
  const own = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) own.addEventListener(key.slice(2), value);
    else if (value !== false) own.setAttribute(key, value === true ? "" : String(value));
  }
  own.append(...children);
  return own;
}

/** Everything on one page. */
class App {
  constructor(data, code, Kind, drawing) {
    this.data = data;
    this.words = words;
    showIn(data.shown || {});
    nameIn(data.unit_names || {});
    this.diagram = new Kind(find("diagram"), data.scene, drawing);
    this.session = null;
    this.recorded = null;
    this.reason = "";
    this.without = data.without;
    this.wanted = {};
    this.shown = 0;
    this.playing = false;
    if (data.live) {
      this.session = new Session(data, code);
      if (!this.session.trusted) {
        this.session = null;
        this.reason = this.words("selftest");
      } else if (data.forces && !this.session.checkForces()) this.without = this.words("differ");
    }
    if (!this.session) {
      this.recorded = new Recorded(data);
      this.reason = this.reason || data.reason;
    }
  }

  get live() { return this.session ? true : this.reason; }

  /** What the pose is led along: its name, unit, and more where it is live. */
  get way() { return this.session ? this.session.motion.way : this.data.driver; }

  /** Bodies and joints that are driven. */
  get driven() {
    const { data } = this;
    return (data.drivers || [data.driver]).map(({ name }) => name.split(".")[0]);
  }

  build() {
    const { data, words } = this;
    find("title").textContent = data.title;
    find("subtitle").textContent = `${data.problem} / ${data.task}${this.session ? "" : ` – ${words("recorded")}: ${this.reason}`}${this.without ? ` – ${words("without")}: ${this.without}` : ""}${data.slow ? ` – ${words("slow")}` : ""}`;
    this.buildDrive();
    if (this.session && data.drivers) this.several = new Several(this, find("dimensions"), made);
    this.buildDimensions();
    this.buildGraph();
    this.buildFiles();
    this.readHash();
    this.fit();
    new ResizeObserver(() => {
      this.diagram.rect = null;
      if (this.chart) this.chart.rect = null;
      this.drawAll();
    }).observe(find("diagram"));
    find("diagram").addEventListener("keydown", (event) => this.key(event));
    document.addEventListener("keydown", (event) => {
      if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z") {
        event.preventDefault();
        this.undo(!event.shiftKey);
      }
    });
    this.dragging();
    this.drawAll();
  }

  // -- controls

  buildDrive() {
    const { data, words } = this;
    const [, unit] = displayed(data.driver.unit);
    this.slider = made("input", { type: "range", min: 0, max: 1, step: "any", "aria-label": `${words("driver")} ${data.driver.name}`,
      oninput: () => this.want({ share: Number(this.slider.value) }) });
    this.number = made("input", { type: "number", step: "any", "aria-label": `${data.driver.name} [${unit}]`, style: "width:8em",
      onchange: () => this.want({ s: Number(this.number.value) / displayed(this.way.unit)[0] }) });
    this.button = made("button", { type: "button", onclick: () => this.play(), "aria-pressed": "false" }, words("play"));
    const tempo = made("select", { "aria-label": words("speed"), onchange: () => { this.tempo = Number(tempo.value); } },
      ...[0.1, 0.25, 0.5, 1, 2, 4].map((k) => made("option", { value: k, selected: k === 1 }, `×${k}`)));
    this.tempo = 1;
    this.unit = made("span", { class: "unit" }, ` ${unit}`);
    const told = made("span", { style: "white-space:nowrap" }, this.number, this.unit);
    find("drive").append(this.button, this.slider, told, tempo);
    if (this.session && data.modes.length > 1) {
      this.modes = made("select", { "aria-label": words("mode"), onchange: () => this.choose(this.modes.value) },
        ...data.modes.map((mode) => made("option", { value: mode.label, selected: mode.label === this.session.mode }, mode.label)));
      find("drive").append(made("label", {}, `${words("mode")} `, this.modes));
    }
    if (data.scene.space) {
      const views = { chosen: null, front: data.scene.space.up[1] > 0.9 ? [0, 0] : [-90, 0] };
      views.top = [views.front[0], 90];
      views.left = [views.front[0] - 90, 0];
      const choice = made("select", { "aria-label": words("view"), title: words("orbit"), onchange: () => {
        if (views[choice.value]) this.diagram.look(...views[choice.value]);
        else this.diagram.home();
        this.drawAll();
      } }, ...Object.keys(views).map((name) => made("option", { value: name }, words(name))));
      find("drive").append(made("label", { title: words("orbit") }, `${words("view")} `, choice));
    }
    if (this.session) {
      const box = (word, checked) => {
        const own = made("input", { type: "checkbox", checked, onchange: () => this.draw() });
        find("drive").append(made("label", {}, own, ` ${words(word)}`));
        return own;
      };
      this.velocities = box("velocities", false);
      this.arrowsOfForces = this.session.forces ? box("forces", true) : null;
      this.shape = data.sliders.length && !data.scene.space ? box("shape", false) : null;
      this.others = data.modes.length > 1 ? box("others", false) : null;
    }
  }

  buildDimensions() {
    const { data, session, words } = this;
    if (!session || !data.sliders.length) return;
    const box = made("fieldset", {}, made("legend", {}, words("dimensions")));
    this.rows = data.sliders.map((slider, k) => {
      const unit = this.unitOf(slider.name);
      const [factor, name] = displayed(unit);
      const range = made("input", { type: "range", min: slider.low, max: slider.high, step: "any", value: slider.value,
        "aria-label": slider.name, "aria-valuetext": quantity(slider.value, unit),
        onpointerdown: () => session.remember(), onkeydown: () => session.remember(),
        oninput: () => this.want({ theta: [k, Number(range.value)] }) });
      const field = made("input", { type: "number", step: "any", value: digits(slider.value * factor, 7), "aria-label": `${slider.name} [${name}]`,
        onchange: () => { session.remember(); this.want({ theta: [k, Number(field.value) / factor] }); } });
      const note = made("span", { class: "note", hidden: true });
      box.append(made("div", { class: "row" }, made("label", {}, slider.name), range, field, made("span", { class: "unit" }, name), note));
      return { range, field, note, factor, unit };
    });
    box.append(
      made("button", { type: "button", onclick: () => this.reset() }, words("reset")), " ",
      made("button", { type: "button", onclick: () => this.undo(true) }, words("undo")), " ",
      made("button", { type: "button", onclick: () => this.undo(false) }, words("redo")));
    find("dimensions").append(box);
  }

  unitOf(name) { return (this.data.units || {})[name] || "m"; }

  buildGraph() {
    const { data, session, words } = this;
    if (!session) return;
    this.what = made("select", { "aria-label": words("output"), style: "max-width:100%", onchange: () => this.drawAll() },
      ...session.outputs().map((path) => made("option", { value: path }, path)));
    // the last body that turns without being driven, else what moves
    const { driven } = this;
    const changes = ({ columns, part }) => !driven.includes(part) && this.moving(columns);
    const usual = data.entries.filter((entry) => entry.kind === "bodies" && changes(entry)).pop();
    const other = data.entries.filter((entry) => entry.kind !== "bodies" && changes(entry)).pop();
    if (usual) this.what.value = `bodies/${usual.part}/${usual.names[data.scene.space ? 1 : 0]}`;
    else if (other) this.what.value = `${other.kind}/${other.part}/${other.names[other.kind === "points" ? 1 : 0]}`;
    if (session.forces) this.what.value = `efforts/${data.forces.efforts[0]}`;
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("style", "width:100%;height:200px;touch-action:none;display:block");
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", words("output"));
    find("graph").append(made("fieldset", {}, made("legend", {}, words("output")), this.what, svg));
    this.chart = new Chart(svg, (s) => this.want({ s }));
    this.plans = new Plans(find("plans"), session, words, made, () => this.draw());
    find("plans").hidden = Boolean(data.scene.space); // polygons are those of the plane
    this.body = made("tbody");
    const head = made("tr", {}, ...[words("quantity"), words("value")].map((word) => made("th", { scope: "col" }, word)));
    find("table").append(made("fieldset", {}, made("legend", {}, words("pose")), made("table", {}, made("thead", {}, head), this.body)));
  }

  buildFiles() {
    const { data } = this;
    const name = `${data.problem}-${data.task}`;
    const button = (text, act) => find("files").append(made("button", { type: "button", onclick: act }, text));
    button("SVG", () => offered(`${name}.svg`, svgText(find("diagram")), "image/svg+xml"));
    button("PNG", async () => offered(`${name}.png`, await png(find("diagram"), getComputedStyle(document.body).backgroundColor)));
    if (this.session) {
      button("CSV", () => { this.session.settle(); offered(`${name}.csv`, csvText(this.session), "text/csv"); });
      button("TOML", () => { const text = this.toml(); if (text) offered(`${data.problem}.toml`, text, "text/plain"); });
    }
    button(this.words("theme"), () => {
      const dark = getComputedStyle(document.documentElement).colorScheme.trim() === "dark"
        || (!document.documentElement.dataset.theme && matchMedia("(prefers-color-scheme: dark)").matches);
      document.documentElement.dataset.theme = dark ? "light" : "dark";
    });
  }

  toml() { return tomlText(this.data.file, this.data.sliders, this.session ? this.session.theta : []); }

  // -- input

  /** Note what is wanted; it is solved and drawn once a frame. */
  want(change) {
    Object.assign(this.wanted, change);
    if (!this.pending) {
      this.pending = true;
      requestAnimationFrame(() => { this.pending = false; this.frame(); });
    }
  }

  frame() {
    const { wanted } = this;
    this.wanted = {};
    const { session } = this;
    let all = false, hurried = false;
    const begun = performance.now();
    if (session) {
      if (wanted.theta) {
        const [k, value] = wanted.theta;
        const theta = [...session.theta];
        theta[k] = value;
        hurried = this.hurried(theta);
        const t = hurried ? 1 : session.dimension(theta);
        this.rows[k].note.hidden = t === 1;
        this.rows[k].note.textContent = t === 1 ? "" : `${this.words(value > session.theta[k] ? "larger" : "smaller")} ${quantity(session.theta[k], this.rows[k].unit)}: ${session.reason}`;
        all = !hurried;
      }
      if (wanted.driver) all = this.several.drive(...wanted.driver) || all;
      if (wanted.reached) this.reached(...wanted.reached);
      if (wanted.pulled) { this.reshape(wanted.pulled); all = true; }
      const [low, high] = session.range;
      if (wanted.share !== undefined) session.drive(low + wanted.share * (high - low));
      if (wanted.s !== undefined && Number.isFinite(wanted.s)) session.drive(wanted.s);
    } else {
      if (wanted.share !== undefined) this.shown = Math.round(wanted.share * (this.recorded.count - 1));
      if (wanted.s !== undefined) this.shown = this.nearest(wanted.s);
    }
    if (all) {
      this.drawAll(!wanted.pulled);
      this.cost = performance.now() - begun;
    } else this.draw();
    if (hurried) this.showNumbers();
  }

  /** Write the address when nothing changes any more: it costs 1 ms, and engines refuse more than some a second. */
  address() {
    clearTimeout(this.addressed);
    this.addressed = setTimeout(() => this.writeHash(), 150);
  }

  /**
   * Where following the whole range takes longer than a frame, carry the pose shown alone;
   * curves, ends and paths come when the hand rests.
   */
  hurried(theta) {
    if (!(this.cost > FRAME) || !this.session.hurry(theta)) return false;
    clearTimeout(this.resting);
    this.resting = setTimeout(() => {
      const begun = performance.now();
      this.session.settle();
      this.drawAll();
      this.cost = performance.now() - begun;
    }, 120);
    return true;
  }

  /** Move several drivers so that a point follows the hand; curves come when it rests. */
  reached(columns, here) {
    if (!this.session.reach(columns, here, (place) => this.diagram.flat(place))) return;
    clearTimeout(this.resting);
    this.resting = setTimeout(() => { this.session.settle(); this.drawAll(false); }, 120);
  }

  nearest(s) {
    let best = 0;
    for (let k = 1; k < this.recorded.count; k += 1) {
      if (Math.abs(this.recorded.value(k) - s) < Math.abs(this.recorded.value(best) - s)) best = k;
    }
    return best;
  }

  choose(label) {
    this.session.remember();
    const ok = this.session.choose(label);
    if (this.modes) this.modes.value = this.session.mode;
    this.drawAll();
    if (!ok) this.say(`${this.words("gone")}: ${this.session.reason}`, true);
    return ok;
  }

  reset() {
    this.session.remember();
    this.session.dimension(this.data.sliders.map((slider) => slider.value));
    this.drawAll();
  }

  undo(back) {
    if (this.session && this.session.undo(back)) this.drawAll();
  }

  play() {
    this.playing = !this.playing;
    this.button.textContent = this.words(this.playing ? "pause" : "play");
    this.button.setAttribute("aria-pressed", String(this.playing));
    let last = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      this.advance((Math.max(now - last, 0) / 1000) * this.tempo);
      last = now;
      requestAnimationFrame(tick);
    };
    if (this.playing) requestAnimationFrame(tick);
  }

  advance(seconds) {
    const { session } = this;
    if (!session) {
      const { recorded } = this;
      if (recorded.at(this.clock || 0) !== this.shown) this.clock = recorded.share(this.shown);
      this.clock = ((this.clock || 0) + seconds / 6) % 1;
      this.shown = recorded.at(this.clock);
      this.draw();
      return;
    }
    const [low, high] = session.range;
    const { pace, turns } = this.way;
    const rate = Math.abs(pace) > 0 ? Math.min(Math.abs(pace), (high - low) / 1.5) : (high - low) / 6;
    const round = turns && session.motion.ends[0] === null && session.motion.ends[1] === null;
    let s = session.s + seconds * rate * (this.sense || 1) * (round ? Math.sign(pace || 1) : 1);
    if (round) s = low + ((((s - low) % (high - low)) + (high - low)) % (high - low));
    else if (s > high || s < low) {
      this.sense = s > high ? -1 : 1;
      s = Math.min(Math.max(s, low), high);
    }
    session.drive(s);
    this.draw();
  }

  key(event) {
    const { session } = this;
    const [low, high] = session ? session.range : [0, this.recorded.count - 1];
    const step = ((high - low) / 360) * (event.shiftKey ? 10 : 1);
    const now = session ? session.s : this.shown;
    const to = (s) => {
      const kept = Math.min(Math.max(s, low), high);
      if (session) this.want({ s: kept });
      else { this.shown = Math.round(kept); this.draw(); }
    };
    const act = {
      ArrowRight: () => to(now + (session ? step : 1)), ArrowLeft: () => to(now - (session ? step : 1)), Home: () => to(low), End: () => to(high),
      " ": () => this.play(), "]": () => this.turnMode(1), "[": () => this.turnMode(-1),
    }[event.key];
    if (act) { event.preventDefault(); act(); return; }
    const turned = { a: [-5, 0], d: [5, 0], w: [0, 5], s: [0, -5] }[event.key.toLowerCase()];
    if (!this.data.scene.space || event.ctrlKey || event.metaKey || event.altKey) return;
    if (turned) this.turnView(...turned);
    else if (event.key === "0") { this.diagram.home(); this.drawAll(); }
  }

  turnMode(by) {
    const { modes } = this.data;
    if (!this.session || !modes || modes.length < 2) return;
    const at = modes.findIndex((mode) => mode.label === this.session.mode);
    this.choose(modes[(at + by + modes.length) % modes.length].label);
  }

  /** Turn what a spatial mechanism is seen from, by degrees. */
  turnView(azimuth, elevation) {
    this.diagram.turn(azimuth, elevation);
    this.drawAll();
  }

  /** Points are dragged along their own paths, from where they are. */
  dragging() {
    const svg = find("diagram");
    let held = null;
    let orbit = null;
    const place = (event) => this.diagram.from(this.diagram.under(event));
    svg.addEventListener("pointerdown", (event) => {
      if (!this.session) return;
      this.session.settle();
      const here = place(event);
      const pose = this.session.pose;
      let best = 14 / this.diagram.scale;
      for (const { kind, part, columns } of this.data.entries) {
        if (kind !== "points" || !pose.y || !(this.several || this.moving(columns))) continue;
        const there = this.diagram.flat(columns.map((k) => pose.y[0][k]));
        const apart = Math.hypot(there[0] - here[0], there[1] - here[1]);
        if (apart < best) { best = apart; held = { part, columns }; }
      }
      if (this.shape && this.shape.checked) held = this.shapedAt(here);
      if (held) svg.setPointerCapture(event.pointerId);
      if (held && held.shaped) this.session.remember();
    });
    svg.addEventListener("pointermove", (event) => {
      if (held && held.shaped) this.want({ pulled: [held.shaped, place(event)] });
      else if (held && this.several) this.want({ reached: [held.columns, place(event)] });
      else if (held) this.pull(held.columns, place(event));
    });
    svg.addEventListener("pointerdown", (event) => {
      if (held || !this.data.scene.space || event.button) return;
      orbit = [event.clientX, event.clientY];
      svg.setPointerCapture(event.pointerId);
    });
    svg.addEventListener("pointermove", (event) => {
      if (!held && orbit) {
        this.turnView((orbit[0] - event.clientX) / 2, (event.clientY - orbit[1]) / 2);
        orbit = [event.clientX, event.clientY];
      }
    });
    for (const name of ["pointerup", "pointercancel"]) svg.addEventListener(name, () => { held = null; orbit = null; });
  }

  /** The point near a place that dimensions place, fixed ones too. */
  shapedAt(here) {
    let best = 14 / this.diagram.scale;
    let held = null;
    for (const [name, [x, y]] of Object.entries(this.now())) {
      const apart = Math.hypot(x - here[0], y - here[1]);
      if (apart < best && slidersAt(this.data, name).length) { best = apart; held = { shaped: name }; }
    }
    return held;
  }

  /** Change the dimensions that place a point so that it comes to where it is pulled. */
  reshape([name, place]) {
    const { session } = this;
    const theta = pulled(session, name, place);
    if (!theta) return;
    const wanted = session.theta.map((value, k) => (theta[k] !== value ? k : -1)).filter((k) => k >= 0);
    const t = session.dimension(theta);
    this.rows.forEach(({ note }, k) => {
      note.hidden = t === 1 || !wanted.includes(k);
      note.textContent = note.hidden ? "" : session.reason;
    });
  }

  moving(columns) {
    const { poses } = this.session;
    if (this.sampled !== poses) {
      const there = poses.filter((pose) => pose.y);
      this.sampled = poses;
      this.two = [there[0], there[Math.floor(there.length / 3)]];
    }
    const [a, b] = this.two;
    return a && b && columns.some((k) => Math.abs(a.y[0][k] - b.y[0][k]) > 1e-12 * Math.max(1, Math.abs(a.y[0][k])));
  }

  /** The place nearest to the pointer on the part of the path around the present one. */
  pull(columns, here) {
    const { session } = this;
    const { places, poses } = session;
    const count = places.length;
    const span = session.range[1] - session.range[0];
    const now = Math.round(((session.s - session.range[0]) / span) * (count - 1));
    const round = this.way.turns && session.motion.ends[0] === null && session.motion.ends[1] === null;
    const apart = (k) => {
      const index = round ? ((k % (count - 1)) + count - 1) % (count - 1) : k;
      const pose = poses[index];
      if (!pose || !pose.y) return Infinity;
      const there = this.diagram.flat(columns.map((k) => pose.y[0][k]));
      return (there[0] - here[0]) ** 2 + (there[1] - here[1]) ** 2;
    };
    let best = now;
    for (const way of [1, -1]) { // only as far as the way there is assembled
      for (let k = now; Math.abs(k - now) <= 30 && apart(k) < Infinity; k += way) if (apart(k) < apart(best)) best = k;
    }
    const [a, b, c] = [apart(best - 1), apart(best), apart(best + 1)];
    const bend = a - 2 * b + c;
    const between = bend > 0 && Number.isFinite(bend) ? Math.max(-0.5, Math.min(0.5, (a - c) / (2 * bend))) : 0;
    let s = session.range[0] + (span * (best + between)) / (count - 1);
    if (round) s = session.range[0] + ((((s - session.range[0]) % span) + span) % span);
    this.want({ s: Math.min(Math.max(s, session.range[0]), session.range[1]) });
  }

  // -- drawing

  fit() {
    const { session, recorded, diagram } = this;
    const poses = session ? session.poses.map((pose) => [session.places_of(pose), session.angles_of(pose)])
      : Array.from({ length: recorded.count }, (_, k) => [recorded.places(k), recorded.turns(k)]);
    if (session && (this.seen !== session.theta || this.seenMode !== session.mode)) diagram.slid(poses);
    if (session) [this.seen, this.seenMode] = [session.theta, session.mode];
    const few = Math.ceil(poses.length / FEW);
    diagram.fit([...poses.flatMap(([places]) => Object.values(places)), ...poses.filter((_, k) => k % few === 0).flatMap((pose) => diagram.extent(...pose))]);
  }

  /** Angles of the bodies in the pose shown, in space rotations. */
  turned() { return this.session ? this.session.angles_of(this.session.pose) : this.recorded.turns(this.shown); }

  /** Places of the points in the pose shown. */
  now() { return this.session ? this.session.places_of(this.session.pose) : this.recorded.places(this.shown); }

  drawAll(fitted = true) {
    const { session } = this;
    if (session) this.look();
    if (fitted) this.fit();
    const { traces } = this.diagram.drawing;
    if (!session) this.diagram.traces(traces.map((name) => Array.from({ length: this.recorded.count }, (_, k) => this.recorded.places(k)[name])));
    else {
      const moving = this.data.entries.filter(({ kind, columns, part }) => kind === "points" && this.moving(columns)
        && traces.includes(part));
      this.diagram.traces(moving.map(({ columns }) => session.poses.map((pose) => (pose.y ? columns.map((k) => pose.y[0][k]) : null))));
      const ends = session.motion.ends.filter((end) => end && end.kind === "limit");
      this.diagram.faint("limits", ends.map((end) => session.places_of(session.motion.atLimit(end.s, end))));
      this.showNumbers();
      const shown = session.output(this.what.value);
      const [factor, name] = displayed(shown.unit);
      const [along, alongName] = displayed(this.way.unit);
      this.chart.draw(session.places, session.poses.map(shown.scalar), {
        value: (value) => digits(value * factor, 4),
        values: ([low, high]) => ticks(low * factor, high * factor, 4).map((value) => value / factor),
        places: ([low, high]) => ticks(low * along, high * along, 6).map((value) => value / along),
        place: (value) => digits(value * along, 4),
        name: [this.words(this.way.name), alongName && `[${alongName}]`, name && `→ [${name}]`].filter(Boolean).join(" "),
      });
    }
    this.draw();
  }

  /** Symbols as the numbers shown make them. */
  look() {
    if (this.looked === this.session.theta) return;
    this.looked = this.session.theta;
    this.session.look(this.data.scene);
  }

  /** Sliders and fields of the dimensions. */
  showNumbers() {
    const { session } = this;
    (this.rows || []).forEach(({ range, field, factor, unit }, k) => {
      range.value = session.theta[k];
      range.setAttribute("aria-valuetext", quantity(session.theta[k], unit));
      if (document.activeElement !== field) field.value = digits(session.theta[k] * factor, 7);
    });
  }

  draw() {
    const { session, data } = this;
    const { driven, way } = this;
    if (!session) {
      this.diagram.draw(this.recorded.places(this.shown), this.recorded.turns(this.shown), this.shown / Math.max(this.recorded.count - 1, 1), driven);
      const value = this.recorded.value(this.shown);
      this.slider.value = this.recorded.count > 1 ? this.shown / (this.recorded.count - 1) : 0;
      this.number.value = digits(value * displayed(data.driver.unit)[0], 7);
      this.say(`${data.driver.name} = ${quantity(value, data.driver.unit)}; ${this.recorded.status(this.shown)}`, false);
      return;
    }
    this.address();
    this.look();
    const pose = session.pose;
    const places = session.places_of(pose), [least, most] = session.range;
    this.diagram.draw(places, session.angles_of(pose), most > least ? Math.min(Math.max((session.s - least) / (most - least), 0), 1) : 0, driven);
    const velocities = {};
    if (this.velocities.checked) {
      for (const { kind, part, columns } of data.entries) {
        const found = kind === "points" ? session.inTime(pose, columns, 1) : null;
        if (found) velocities[part] = found;
      }
    }
    const forces = session.forcesAt(pose);
    this.diagram.arrows("arrows", "velocity", places, velocities);
    this.diagram.arrows("forces", "force", places, this.arrowsOfForces && this.arrowsOfForces.checked && forces ? this.reactionsAt(forces) : {});
    this.showOthers();
    this.plans.draw(pose, forces);
    const [low, high] = session.range;
    this.slider.value = (session.s - low) / (high - low);
    const told = way.unit ? quantity(session.s, way.unit) : digits(session.s, 7);
    this.slider.setAttribute("aria-valuetext", told);
    if (document.activeElement !== this.number) this.number.value = digits(session.s * displayed(way.unit)[0], 7);
    if (this.several) this.showWay();
    this.chart.mark(session.s, session.output(this.what.value).scalar(pose));
    this.table(pose, forces);
    const head = `${this.words(way.name)} = ${told}`;
    if (pose.status === "ok") {
      const bound = session.motion.bound(pose);
      this.say(`${head}; ${this.words("certified")}, ${this.words("bound")} ${rounded(bound.length, "m")}, ${rounded(bound.angle, "rad")}${this.told(forces)}`, Boolean(forces) && forces.status !== "ok");
    } else if (pose.status === "limit") this.say(`${head}; ${this.words("limit")}: ${pose.end.group} (${pose.end.joint})`, false);
    else this.say(`${head}; ${this.words("unassembled")}: ${session.reason || session.opening(session.s)}`, true);
  }

  /** Names of what the slider moves along, and the values of all drivers. */
  showWay() {
    const { way, words } = this;
    const [, unit] = displayed(way.unit);
    this.unit.textContent = ` ${unit}`;
    this.slider.setAttribute("aria-label", `${words("driver")} ${words(way.name)}`);
    this.number.setAttribute("aria-label", `${words(way.name)} [${unit}]`);
    this.several.draw();
  }

  /** Reactions on the second body of each joint, by the point where they act. */
  reactionsAt(forces) {
    const found = {};
    for (const { name, at } of this.data.forces.joints) {
      const own = forces.reactions[name];
      if (own) found[at] = found[at] ? [found[at][0] + own[0], found[at][1] + own[1]] : own.slice(0, 2);
    }
    return found;
  }

  /** What is to be said of the forces of a pose. */
  told(forces) {
    if (!forces) return "";
    const { words } = this;
    if (forces.status === "jammed") return `; ${words("jammed")}${forces.critical === null ? "" : ` (${words("critical")}: ${digits(forces.critical, 4)})`}`;
    const own = Object.entries(forces.efforts).map(([name, value]) => `${words("effort")} ${quantity(value, this.session.data.forces.units[name], 5)}`);
    return `; ${own.join(", ")}${forces.status === "ambiguous" ? `; ${words("ambiguous")}` : ""}${forces.still ? `; ${words("still")}` : ""}`;
  }

  /** The other assembly modes, faintly; a click goes over to one. */
  showOthers() {
    if (!this.others) return;
    const { session } = this;
    if (session.held) return;
    if (!this.others.checked) { this.diagram.faint("ghosts", []); return; }
    session.ghosts.carry(session.theta, session.range, session.mode, this.way, session.drivers());
    const found = session.ghosts.at(session.s);
    this.diagram.faint("ghosts", found.map(({ pose }) => session.places_of(pose)), (k) => {
      const { s } = session;
      if (this.choose(found[k].label)) this.want({ s });
    }, found.map(({ label }) => label));
  }

  table(pose, forces) {
    const rows = [];
    const row = (name, text) => rows.push([name, text]);
    if (forces && forces.status !== "jammed") {
      for (const [name, value] of Object.entries(forces.efforts)) row(`${this.words("effort")} ${name}`, quantity(value, this.session.data.forces.units[name]));
      for (const [name, [x, y, moment]] of Object.entries(forces.reactions)) row(`R ${name}`, `${quantity(Math.hypot(x, y), "N", 5)}; ${quantity(moment, "N m", 5)}`);
    }
    for (const { kind, part, columns, names, unit } of this.data.entries) {
      if (bareAngle({ kind, names })) continue;
      const found = this.session.told(pose, { columns, names }, 0);
      const speed = this.session.told(pose, { columns, names }, 1);
      const shown = (v) => (names[0] === "orientation" ? digits(v, 5) : quantity(v, unit, 5));
      const noise = found && 1e-12 * Math.max(...found.map(Math.abs)); // beside the largest component
      const text = found ? (found.length > 1 ? `(${found.map((v) => shown(Math.abs(v) < noise ? 0 : v)).join(", ")})` : quantity(found[0], unit)) : "–";
      const rate = speed ? quantity(Math.hypot(...speed) * (speed.length === 1 && speed[0] < 0 ? -1 : 1), `${unit}/s`, 5) : "–";
      row(part, `${text}; ${rate}`);
    }
    // rows that stay are kept: only texts that changed are laid out again
    while (this.body.rows.length > rows.length) this.body.deleteRow(-1);
    rows.forEach((texts, k) => {
      const own = this.body.rows[k] || this.body.appendChild(made("tr", {}, made("td"), made("td")));
      texts.forEach((text, j) => { if (own.cells[j].textContent !== text) own.cells[j].textContent = text; });
    });
  }

  say(text, warn) {
    const own = find("status");
    own.className = warn ? "warn" : "";
    if (own.textContent === text) return;
    const now = performance.now();
    if (this.playing && this.spoken && now - this.spoken < 500) return;
    this.spoken = now;
    own.textContent = text;
  }

  // -- address

  writeHash() {
    if (!this.session || location.protocol === "about:") return;
    const parts = this.data.sliders.flatMap((slider, k) => (this.session.theta[k] === slider.value ? [] : [`${encodeURIComponent(slider.name)}=${this.session.theta[k]}`]));
    const { way } = this;
    if (way !== this.session.way) parts.push(`drivers=${this.session.drivers()}`, `along=${encodeURIComponent(way.name)}`);
    else if (this.session.s !== this.data.start.s) parts.push(`s=${this.session.s}`);
    const own = (this.data.modes.find((mode) => mode.own) || {}).label;
    if (this.session.mode && this.session.mode !== own) parts.push(`mode=${encodeURIComponent(this.session.mode)}`);
    try { history.replaceState(null, "", parts.length ? `#${parts.join("&")}` : location.pathname + location.search); } catch { /* in a frame without address */ }
  }

  readHash() {
    if (!this.session || location.hash.length < 2) return;
    const given = new Map(location.hash.slice(1).split("&").map((part) => part.split("=").map(decodeURIComponent)));
    if (given.has("mode")) this.session.choose(given.get("mode"));
    const theta = this.data.sliders.map((slider, k) => {
      const value = Number(given.get(slider.name));
      return given.has(slider.name) && Number.isFinite(value) ? value : this.session.theta[k];
    });
    if (theta.some((value, k) => value !== this.session.theta[k])) this.session.dimension(theta);
    const u = (given.get("drivers") || "").split(",").map(Number);
    const k = (this.data.drivers || []).findIndex(({ name }) => name === given.get("along"));
    if (k >= 0 && u.length === this.data.drivers.length && u.every(Number.isFinite)) this.session.move(u, k);
    const s = Number(given.get("s"));
    if (given.has("s") && Number.isFinite(s)) this.session.drive(s);
  }
}

/** The interface for embedding and tests. */
function interfaceOf(app) {
  const { data } = app;
  const own = {
    reason: "",
    get live() { return app.live; },
    ready: Promise.resolve(true),
    pose() {
      const { session } = app;
      if (!session) {
        const places = app.recorded.places(app.shown);
        const points = Object.fromEntries(Object.entries(places).map(([name, position]) => [name, { position }]));
        return { driver: { [data.driver.name]: app.recorded.value(app.shown) }, status: app.recorded.status(app.shown), mode: "", bound: null, points, bodies: {}, joints: {}, efforts: {} };
      }
      const pose = session.pose;
      const driver = { [app.way.name]: session.s };
      if (data.drivers) session.drivers().forEach((value, k) => { driver[data.drivers[k].name] = value; });
      const result = { driver, status: pose.status, mode: session.mode, bound: session.motion.bound(pose), points: {}, bodies: {}, joints: {}, efforts: {} };
      if (!pose.y) return result;
      for (const { kind, part, columns, names } of data.entries) {
        const table = (result[kind][part] = result[kind][part] || {});
        names.forEach((name, order) => {
          const found = session.told(pose, { columns, names }, order);
          if (bareAngle({ kind, names }) && order) return;
          table[name] = found && found.length === 1 ? found[0] : found;
        });
      }
      const forces = session.forcesAt(pose);
      if (forces) {
        if (forces.status !== "ok") result.status = forces.status;
        result.efforts = forces.efforts;
        for (const [name, reaction] of Object.entries(forces.reactions)) Object.assign((result.joints[name] = result.joints[name] || {}), { reaction });
        for (const [name, loss] of Object.entries(forces.losses)) result.joints[name].loss = loss;
      }
      return result;
    },
    set(values) {
      const { session } = app;
      if (!session) { own.reason = app.reason; return false; }
      session.settle();
      const theta = [...session.theta];
      let s = null, moved = null;
      const names = (data.drivers || []).map((own) => own.name);
      for (const [name, value] of Object.entries(values)) {
        const k = data.sliders.findIndex((slider) => slider.name === name);
        if (typeof value !== "number" || !Number.isFinite(value)) { own.reason = `${name} ${app.words("nonumber")}`; return false; }
        if (names.includes(name)) (moved = moved || {})[names.indexOf(name)] = value;
        else if (name === app.way.name) s = value;
        else if (k >= 0) theta[k] = value;
        else { own.reason = `${app.words("noname")} ${name}`; return false; }
      }
      const before = session.now();
      let ok = true;
      if (theta.some((value, k) => value !== session.theta[k])) ok = session.dimension(theta) === 1;
      own.reason = session.reason;
      if (ok && moved) { ok = session.move(session.drivers().map((value, i) => moved[i] ?? value), Number(Object.keys(moved)[0])) === 1; own.reason = session.reason; }
      if (ok && s !== null) { ok = session.drive(s); own.reason = session.reason; }
      if (!ok) { const { reason } = own; session.restore(before); own.reason = reason; }
      app.drawAll();
      return ok;
    },
    sweep(path, count = 361) {
      const { session } = app;
      if (!session) return [];
      session.settle();
      const output = session.output(path);
      const [low, high] = session.range;
      return Array.from({ length: count }, (_, k) => {
        const pose = session.motion.pose(count > 1 ? low + ((high - low) * k) / (count - 1) : low);
        if (!output.whole) return output.scalar(pose);
        const found = output.of(pose);
        return found && found.length === 1 ? found[0] : found;
      });
    },
    limits() {
      if (app.session) app.session.settle();
      return app.session ? app.session.motion.ends.map((end) => (end && end.kind === "limit" ? end.s : null)) : [null, null];
    },
    modes() { return app.session ? data.modes.map((mode) => mode.label) : []; },
    choose(label) {
      if (!app.session) { own.reason = app.reason; return false; }
      const ok = app.choose(label);
      own.reason = ok ? "" : app.session.reason;
      return ok;
    },
    toml() { return app.toml(); },
    /** The direction a spatial mechanism is seen from [deg]; null in the plane. */
    view() { return data.scene.space ? { azimuth: app.diagram.view.azimuth, elevation: app.diagram.view.elevation } : null; },
  };
  return own;
}

/** Start the page with the diagrams of the plane or of space. */
export function begin(Kind) {
  const given = JSON.parse(find("mechdae").textContent);
  if (isWhole(find("mechdae").textContent, SUM)) {
    const app = new App(given, K, Kind, DRAWING);
    app.build();
    window.mechdae = interfaceOf(app);
    return;
  }
  const reason = words("damaged");
  find("title").textContent = String(given.title);
  find("status").className = "warn";
  find("status").textContent = reason;
  window.mechdae = { live: reason, reason, ready: Promise.resolve(false), set: () => false, choose: () => false, pose: () => null };
}
