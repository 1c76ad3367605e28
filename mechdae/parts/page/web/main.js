/** The page: reads its data, makes the controls, draws when something changed. */
import { sentence, words } from "./words.js";
import { Session } from "./session.js";
import { Recorded } from "./recorded.js";
import { isWhole } from "./whole.js";
import { digits, displayed, nameIn, quantity, rounded, showIn } from "./units.js";
import { find, made, showFailures, typed } from "./made.js";
import { scriptOf } from "./compile.js";
import { Tabs } from "./tabs.js";
import { Dimensions } from "./dimensions.js";
import { Curves, forceThings, lightThings, recordedThings, thingsOf } from "./curves.js";
import { Strip, turning } from "./grashof.js";
import { Modes } from "./modes.js";
import { Values } from "./values.js";
import { Several } from "./several.js";
import { Hand } from "./hand.js";
import { readHash, writeHash } from "./address.js";
import { interfaceOf } from "./interface.js";
import { csvText, offered, png, svgText, tomlText } from "./files.js";

/** Milliseconds that a change may take to be drawn whole in each frame. */
const FRAME = 12;
/** Poses whose wheels and guides the picture has to hold. */
const FEW = 12;
/** What is read of the pose while it plays is written so often [ms]. */
const READ = 250;
/** Frames that are counted. */
const COUNTED = 120;

/** Everything on one page. */
class App {
  constructor(data, code, Kind, drawing, panels) {
    Object.assign(this, { data, panels });
    showIn(data.shown || {});
    nameIn(data.unit_names || {}, data.lang === "ru" ? "," : ".");
    this.diagram = new Kind(find("diagram"), data.scene, drawing);
    this.reason = data.reason;
    this.without = data.without;
    this.wanted = {};
    this.playing = false;
    const solved = data.live ? new Session(data, code, panels.Forces) : null;
    if (solved && !solved.trusted) this.reason = words("selftest");
    else if (solved && data.forces && !solved.checkForces()) this.without = words("differ");
    /** What is shown: poses that are solved here (`live`), or recorded ones. */
    this.session = this.reason ? new Recorded(data) : solved;
  }

  get live() { return this.session.live || this.reason; }

  /** What the pose is led along: its name, unit, and more where it is live. */
  get way() { return this.session.motion.way; }

  /** Bodies and joints that are driven. */
  get driven() {
    const { data } = this;
    return (data.drivers || [data.driver]).map(({ name }) => name.split(".")[0]);
  }

  /** Places of the curves, what they are over, and events there. */
  along() {
    const { session, way } = this;
    return { places: session.places, way: { name: words(way.name), unit: way.unit || "" }, events: session.events || [] };
  }

  /** What acts on the links in the pose shown; null without forces. */
  balance() {
    const { session } = this, forces = session.forcesAt(session.pose), equations = forces && forces.status !== "jammed" && this.equations();
    return equations ? new this.panels.Balance(session, equations, forces) : null;
  }

  /** The vector equations of the pose shown; null where there is none. */
  equations() {
    const { session } = this, { pose } = session;
    if (!pose.y || !this.data.lesson.groups.length) return null;
    if (this.equated !== pose) [this.equated, this.equationsThere] = [pose, new this.panels.Equations(session, pose, (place) => this.diagram.flat(place))];
    return this.equationsThere;
  }

  build() {
    const { data, session } = this;
    find("title").textContent = data.title;
    find("subtitle").textContent = `${data.problem} / ${data.task}${session.live ? "" : ` – ${words("recorded")}: ${this.reason}`}${this.without ? ` – ${words("without")}: ${this.without}` : ""}${data.slow ? ` – ${words("slow")}` : ""}`;
    this.buildDrive();
    if (session.live && data.drivers) this.several = new Several(this);
    this.buildTabs();
    this.buildFiles();
    this.hand = new Hand(this);
    readHash(this);
    this.fit();
    new ResizeObserver(() => { this.diagram.rect = null; this.drawAll(); this.drawTab(); }).observe(find("diagram"));
    find("diagram").addEventListener("keydown", (event) => this.key(event));
    document.addEventListener("keydown", (event) => {
      if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z") {
        event.preventDefault();
        this.undo(!event.shiftKey);
      } else if (event.key === "?" && !/input|select/i.test(event.target.tagName)) find("help").showModal();
    });
    this.drawAll();
  }

  // -- controls

  buildDrive() {
    const { data, session } = this, [, unit] = displayed(data.driver.unit);
    this.slider = made("input", { type: "range", min: 0, max: 1, step: "any", "aria-label": `${words("driver")} ${data.driver.name}`, title: words("about_driver"),
      oninput: () => this.want({ share: Number(this.slider.value) }) });
    this.number = made("input", { type: "text", inputmode: "decimal", "aria-label": `${data.driver.name} [${unit}]`, title: words("type_number"),
      onblur: () => this.showNumber(),
      onchange: () => typed(this.number.value, (value) => this.want({ s: value / displayed(this.way.unit)[0] }), (text) => this.say(text, true)) });
    this.button = made("button", { type: "button", title: words("about_play"), onclick: () => this.play(), "aria-pressed": "false" }, words("play"));
    const tempo = made("select", { "aria-label": words("speed"), title: words("about_speed"), onchange: () => { this.tempo = Number(tempo.value); } },
      ...[0.1, 0.25, 0.5, 1, 2, 4].map((k) => made("option", { value: k, selected: k === 1 }, `×${digits(k)}`)));
    this.tempo = 1;
    this.unit = made("span", { class: "unit" }, ` ${unit}`);
    find("drive").append(this.button, this.slider, made("span", { class: "told" }, this.number, this.unit), tempo);
    if (data.scene.space) this.buildView();
    const box = (word, checked, there) => {
      const own = made("input", { type: "checkbox", checked, onchange: () => this.draw() });
      if (there) find("switches").append(made("label", { title: words(`about_${word}`) }, own, ` ${words(word)}`));
      return own;
    };
    const flat = !data.scene.space;
    this.switches = { velocities: box("velocities", false, session.live), forces: box("forces", true, session.forces),
      centres: box("centres", false, session.live && flat), transmission: box("transmission", false, session.live && data.lesson.transmission.length) };
  }

  /** From where a spatial mechanism is seen; what was turned by hand has no name. */
  buildView() {
    const { up } = this.data.scene.space, front = up[1] > 0.9 ? [0, 0] : [-90, 0];
    const views = { chosen: null, front, top: [front[0], 90], left: [front[0] - 90, 0] };
    this.view = made("select", { "aria-label": words("view"), title: words("orbit"), onchange: () => {
      const own = views[this.view.value];
      if (own) this.diagram.look(...own);
      else this.diagram.home();
      this.drawAll();
    } }, ...Object.keys(views).map((name) => made("option", { value: name }, words(name))), made("option", { value: "turned", hidden: true }, words("turned")));
    find("drive").append(made("label", { title: words("orbit") }, `${words("view")} `, this.view));
  }

  buildTabs() {
    const { data, session } = this;
    this.tabs = new Tabs(find("tabs"), () => { if (this.hand) this.drawTab(); });
    const tab = (id, ...drawing) => this.tabs.add(id, words(`tab_${id}`), words(`about_tab_${id}`), { whole: (anew) => drawing.forEach((own) => own.whole && own.whole(anew)), frame: (...given) => drawing.forEach((own) => own.frame && own.frame(...given)) });
    this.dimensions = new Dimensions(this);
    lightThings(this.diagram);
    if (!session.live) {
      const things = recordedThings(session), begin = [...things.filter(({ kind }) => kind === "bodies").slice(0, 1), ...things.filter(({ kind }) => kind === "scalars")];
      this.curves = new Curves(this, "curves", things, begin.length ? begin : things.slice(0, 1));
      tab("curves", this.curves);
      tab("dimensions", this.dimensions);
      return;
    }
    if (this.panels.Overlays) this.overlays = new this.panels.Overlays(this);
    this.strip = new Strip(this);
    if (data.sliders.length || data.drivers) tab("dimensions", this.dimensions, this.strip);
    if (data.sliders.length && !data.scene.space) {
      this.shape = made("input", { type: "checkbox" });
      find("dimensions").append(made("label", { title: words("about_shape") }, this.shape, ` ${words("shape")}`));
    }
    const things = thingsOf(this), moves = things.filter(({ columns }) => session.moving(columns));
    const led = (sort) => moves.filter(({ kind, parts, columns }) => kind === sort && columns.length === 1 && !this.driven.includes(parts[0])).pop(); // has an angle or a slide
    const usual = led("bodies") || (data.scene.space && led("joints")) || moves.filter(({ lines }) => lines[0].unit !== "1").pop() || moves.pop();
    this.curves = new Curves(this, "curves", things, [usual]);
    tab("curves", this.curves, new Values(this, "curves"));
    if (data.lesson.groups.length) {
      this.plans = new this.panels.Plans(this, () => this.drawTab());
      tab("plans", this.plans);
    }
    if (session.forces) {
      const acting = forceThings(this);
      this.efforts = new Curves(this, "forces", acting, [acting[0], ...acting.filter(({ kind }) => kind === "joints").slice(0, 2)]);
      tab("forces", this.efforts, new Values(this, "forces"));
    }
    if (data.lesson.groups.length) {
      this.explain = new this.panels.Explain(this);
      tab("explain", this.explain);
    }
    if (data.modes.length > 1) {
      this.others = made("input", { type: "checkbox", onchange: () => this.draw() });
      tab("modes", new Modes(this, this.others));
    }
  }

  buildFiles() {
    const { data } = this, name = `${data.problem}-${data.task}`;
    const button = (text, about, act) => find("files").append(made("button", { type: "button", title: words(about), onclick: act }, text));
    button("SVG", "about_svg", () => offered(`${name}.svg`, svgText(find("diagram")), "image/svg+xml"));
    button("PNG", "about_png", async () => offered(`${name}.png`, await png(find("diagram"), getComputedStyle(document.body).backgroundColor)));
    if (this.session.live) {
      button("CSV", "about_csv", () => { this.session.settle(); offered(`${name}.csv`, csvText(this.session), "text/csv"); });
      button("TOML", "about_toml", () => { const text = this.toml(); if (text) offered(`${data.problem}.toml`, text, "text/plain"); else this.say(words("unwritten"), true); });
    }
    button("◐", "theme", () => {
      const dark = getComputedStyle(document.documentElement).colorScheme.trim() === "dark"
        || (!document.documentElement.dataset.theme && matchMedia("(prefers-color-scheme: dark)").matches);
      document.documentElement.dataset.theme = dark ? "light" : "dark";
    });
    const keys = ["drag", "click", "wheel", "pan", "arrows", "space", ...(data.modes && data.modes.length > 1 ? ["brackets"] : []), "zero", ...(data.scene.space ? ["turn"] : []), "undo"];
    find("help").append(made("h2", {}, words("keys")), made("dl", {}, ...keys.flatMap((key) => [made("dt", {}, words(`key_${key}`)), made("dd", {}, words(`does_${key}`))])), made("form", { method: "dialog" }, made("button", {}, words("close"))));
    find("help").setAttribute("aria-label", words("keys"));
    button("?", "keys", () => find("help").showModal());
  }

  toml() { return tomlText(this.data.file, this.data.sliders || [], this.session.theta); }

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
    const { wanted, session } = this;
    this.wanted = {};
    let all = false, hurried = false;
    const begun = performance.now();
    if (wanted.theta) {
      const [k, value] = wanted.theta;
      const theta = [...session.theta];
      theta[k] = value;
      hurried = this.hurried(theta);
      const t = hurried ? 1 : session.dimension(theta);
      this.dimensions.rows[k].say(t === 1 ? "" : session.refusal(theta) || `${words(value > session.theta[k] ? "larger" : "smaller")} ${quantity(session.theta[k], this.dimensions.rows[k].unit)}: ${session.reason}`);
      all = !hurried;
    }
    if (wanted.driver) all = this.several.drive(...wanted.driver) || all;
    if (wanted.reached) this.reached(...wanted.reached);
    if (wanted.pulled) { this.hand.reshape(wanted.pulled); all = true; }
    const [low, high] = session.range;
    if (wanted.share !== undefined) session.drive(low + wanted.share * (high - low));
    if (wanted.s !== undefined) session.drive(session.at(wanted.s));
    if (all) {
      this.drawAll(!wanted.pulled);
      this.cost = performance.now() - begun;
    } else this.draw();
    if (hurried) this.dimensions.whole();
  }

  /** Write the address when nothing changes any more: it costs 1 ms, and engines refuse more than some a second. */
  address() {
    clearTimeout(this.addressed);
    this.addressed = setTimeout(() => writeHash(this), 150);
  }

  /**
   * Where following the whole range takes longer than a frame, carry the pose shown alone;
   * curves, ends and paths come when the hand rests.
   */
  hurried(theta) {
    if (!(this.cost > FRAME) || !this.session.hurry(theta)) return false;
    this.rest();
    return true;
  }

  /** Follow and draw the whole range when nothing changes any more. */
  rest(fitted = true) {
    clearTimeout(this.resting);
    this.resting = setTimeout(() => {
      const begun = performance.now();
      this.session.settle();
      this.drawAll(fitted);
      this.cost = performance.now() - begun;
    }, 120);
  }

  /** Move several drivers so that a point follows the hand; curves come when it rests. */
  reached(columns, here) {
    if (this.session.reach(columns, here, (place) => this.diagram.flat(place))) this.rest(false);
  }

  choose(label) {
    this.session.remember();
    const ok = this.session.choose(label);
    this.drawAll();
    if (!ok) this.say(`${words("gone")}: ${this.session.reason}`, true);
    return ok;
  }

  reset() {
    this.session.remember();
    this.session.dimension(this.data.sliders.map((slider) => slider.value));
    if (this.several) this.several.choose(-1);
    else this.drawAll();
  }

  undo(back) {
    if (this.session.live && this.session.undo(back)) this.drawAll();
  }

  play() {
    this.playing = !this.playing;
    this.button.textContent = words(this.playing ? "pause" : "play");
    this.button.setAttribute("aria-pressed", String(this.playing));
    let last = performance.now();
    this.times = [];
    const tick = (now) => {
      if (!this.playing) return;
      this.times.push(now);
      if (this.times.length > COUNTED) this.times.shift();
      this.session.advance((Math.max(now - last, 0) / 1000) * this.tempo);
      this.draw();
      last = now;
      requestAnimationFrame(tick);
    };
    if (this.playing) requestAnimationFrame(tick);
    else this.draw();
  }

  /** Frames a second of those that were played last. */
  get frames() {
    const { times = [] } = this;
    return times.length > 1 ? (1000 * (times.length - 1)) / (times[times.length - 1] - times[0]) : 0;
  }

  key(event) {
    const { session } = this, [low, high] = session.range;
    const step = session.step * (event.shiftKey ? 10 : 1);
    const to = (s) => { session.drive(Math.min(Math.max(s, low), high)); this.draw(); };
    const act = {
      ArrowRight: () => to(session.s + step), ArrowLeft: () => to(session.s - step), Home: () => to(low), End: () => to(high),
      " ": () => this.play(), "]": () => this.turnMode(1), "[": () => this.turnMode(-1), "+": () => this.zoom(1.25), "-": () => this.zoom(0.8),
      0: () => { if (this.view) { this.diagram.home(); this.view.value = "chosen"; } this.zoom(0); },
    }[event.key];
    if (act) { event.preventDefault(); act(); return; }
    const turned = { a: [-5, 0], d: [5, 0], w: [0, 5], s: [0, -5] }[event.key.toLowerCase()];
    if (turned && this.view && !event.ctrlKey && !event.metaKey && !event.altKey) this.turnView(...turned);
  }

  turnMode(by) {
    const { modes } = this.data;
    if (!this.session.live || modes.length < 2) return;
    const at = modes.findIndex((mode) => mode.label === this.session.mode);
    this.choose(modes[(at + by + modes.length) % modes.length].label);
  }

  /** Turn what a spatial mechanism is seen from, by degrees. */
  turnView(azimuth, elevation) {
    this.diagram.turn(azimuth, elevation);
    this.view.value = "turned";
    this.drawAll();
  }

  /** Show the diagram larger about a place of the sheet, by default its middle; 0 fits it. */
  zoom(times, place = this.diagram.size.map((side) => side / 2)) {
    this.diagram.zoom(times, place);
    this.drawAll(times === 0);
  }

  pan(x, y) {
    this.diagram.pan(x, y);
    this.drawAll(false);
  }

  // -- drawing

  fit() {
    const { session, diagram } = this, poses = session.poses.map((pose) => [session.places_of(pose), session.angles_of(pose)]);
    if (session.live && (this.seen !== session.theta || this.seenMode !== session.mode)) diagram.slid(poses);
    [this.seen, this.seenMode] = [session.theta, session.mode];
    const few = Math.ceil(poses.length / FEW);
    diagram.fit([...poses.flatMap(([places]) => Object.values(places)), ...poses.filter((_, k) => k % few === 0).flatMap((pose) => diagram.extent(...pose))]);
  }

  /** Angles of the bodies in the pose shown, in space rotations. */
  turned() { return this.session.angles_of(this.session.pose); }

  /** Places of the points in the pose shown. */
  now() { return this.session.places_of(this.session.pose); }

  drawAll(fitted = true) {
    const { session } = this;
    this.look();
    if (fitted) this.fit();
    this.diagram.traces(this.diagram.drawing.traces.map((name) => session.track(name)).filter(Boolean));
    if (session.live) {
      const ends = session.motion.ends.filter((end) => end && end.kind === "limit");
      this.diagram.faint("limits", ends.map((end) => session.places_of(session.motion.atLimit(end.s, end))), null, ends.map(({ group, joint }) => `${words("limit")}: ${group} (${joint})`));
      if (this.told !== session.poses) find("sentence").textContent = turning(this);
      this.told = session.poses;
    }
    this.tabs.drawing.whole(false);
    this.draw();
  }

  /** The panel that is shown, whole. */
  drawTab() {
    if (this.explain && this.tabs.shown !== "explain") this.explain.clear();
    this.tabs.drawing.whole(true);
    this.reading = true;
    this.drawFrame();
    if (this.tabs.shown !== "dimensions") this.dimensions.frame();
  }

  /** What of the panel shown belongs to the pose. */
  drawFrame() {
    const { session } = this, { pose } = session;
    this.tabs.drawing.frame(pose, session.forcesAt(pose));
  }

  /** Symbols as the numbers shown make them. */
  look() {
    if (!this.session.live || this.looked === this.session.theta) return;
    this.looked = this.session.theta;
    this.session.look(this.data.scene);
  }

  draw() {
    const { session, data, way } = this, now = performance.now();
    this.reading = !this.playing || now - (this.read || 0) >= READ; // nobody reads faster
    if (this.reading) this.read = now;
    this.address();
    this.look();
    const pose = session.pose;
    const places = session.places_of(pose), [low, high] = session.range, [begin, end] = session.live ? this.diagram.drawing.range : session.range;
    const forces = session.forcesAt(pose);
    this.diagram.draw(places, session.angles_of(pose), Math.min(Math.max((session.s - begin) / (end - begin || 1), 0), 1), forces ? forces.senses : {});
    const velocities = {};
    if (this.switches.velocities.checked) {
      for (const { kind, part, columns } of data.entries) {
        const found = kind === "points" ? session.inTime(pose, columns, 1) : null;
        if (found) velocities[part] = found;
      }
    }
    this.diagram.arrows("arrows", "velocity", places, velocities);
    this.diagram.arrows("forces", "force", places, this.switches.forces.checked && forces ? this.reactionsAt(forces) : {});
    if (this.overlays) this.overlays.frame(pose);
    this.showOthers();
    this.slider.value = (session.s - low) / (high - low || 1);
    this.drawFrame();
    if (this.dimensions.one >= 0 && this.tabs.shown !== "dimensions") this.dimensions.frame();
    if (this.reading) this.tell(pose, forces, way);
  }

  /** Texts of the pose: the driver's value, what is proved of it. */
  tell(pose, forces, way) {
    const { session } = this, value = way.unit ? quantity(session.value, way.unit) : digits(session.value, 7);
    this.slider.setAttribute("aria-valuetext", value);
    if (document.activeElement !== this.number) this.showNumber();
    if (this.several) this.showWay();
    const head = `${words(way.name)} = ${value}`;
    if (!session.live) this.say(`${head}; ${words(pose.status)}`, false);
    else if (pose.status === "ok") {
      const bound = session.motion.bound(pose);
      this.say(`${head}; ${words("certified")}, ${words("bound")} ${rounded(bound.length, "m")}, ${rounded(bound.angle, "rad")}${this.toldForces(forces)}`, Boolean(forces) && forces.status !== "ok");
    } else if (pose.status === "limit") this.say(`${head}; ${words("limit")}: ${pose.end.group} (${pose.end.joint})`, false);
    else this.say(`${head}; ${words("unassembled")}: ${session.opening(session.s) || session.reason}`, true);
  }

  showNumber() { this.number.value = digits(this.session.value * displayed(this.way.unit)[0], 7); }

  /** Names of what the slider moves along, and the values of all drivers. */
  showWay() {
    const { way } = this, [, unit] = displayed(way.unit);
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
  toldForces(forces) {
    if (!forces) return "";
    if (forces.status === "jammed") return `; ${words("jammed")}${forces.critical === null ? "" : ` (${words("critical")}: ${digits(forces.critical, 4)})`}`;
    const own = Object.entries(forces.efforts).map(([name, value]) => `${words("effort")} ${quantity(value, this.session.data.forces.units[name], 5)}`);
    return `; ${own.join(", ")}${forces.status === "ambiguous" ? `; ${words("ambiguous")}` : ""}${forces.still ? `; ${words("still")}` : ""}`;
  }

  /** Labels and poses of the other assembly modes at the driver's value. */
  otherPoses() {
    const { session } = this;
    session.settle();
    session.ghosts.carry(session.theta, session.range, session.mode, this.way, session.drivers());
    return session.ghosts.at(session.s);
  }

  /** The other assembly modes, faintly; a click goes over to one. */
  showOthers() {
    const { session } = this;
    if (!this.others || session.held) return;
    if (!this.others.checked) {
      if (this.diagram.layers.ghosts.firstChild) this.diagram.faint("ghosts", []);
      return;
    }
    const found = this.otherPoses();
    this.diagram.faint("ghosts", found.map(({ pose }) => session.places_of(pose)), (k) => {
      const { s } = session;
      if (this.choose(found[k].label)) this.want({ s });
    }, found.map(({ label }) => label));
  }

  say(text, warn) {
    const own = find("status");
    own.className = warn ? "warn" : "";
    if (own.textContent !== text) own.textContent = text;
  }
}

/** What a script gives, run as the page's policy lets one be. */
function run(text) {
  const script = made("script", {}, `window.mechdae = ${text}`);
  document.head.append(script);
  script.remove();
  return window.mechdae;
}

/** Start the page with the diagrams of the plane or of space; `panels` are the classes of what is shown beside them. */
export function begin(Kind, panels) {
  showFailures();
  document.head.append(made("style", {}, LOOK));
  const given = JSON.parse(find("mechdae").textContent);
  if (isWhole(find("mechdae").textContent, SUM)) {
    const app = new App({ ...given, ...STORED }, KERNELS ? run(scriptOf(KERNELS)) : {}, Kind, DRAWING, panels);
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
