/** The pointer in the diagram: points are dragged along their paths, clicks choose, the wheel zooms, the ground pans or turns. */
import { element } from "./view.js";
import { pulled, slidersAt } from "./shape.js";
import { light } from "./light.js";

/** How near the pointer has to be [px], and how far it may move in a click. */
const NEAR = 20, STILL = 4;

export class Hand {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    const { svg } = app.diagram;
    this.ring = element("circle", { class: "ring", r: 8, display: "none" }, svg);
    this.held = null;
    const on = (name, act, options) => svg.addEventListener(name, act, options);
    on("pointerdown", (event) => this.down(event));
    on("pointermove", (event) => this.move(event));
    on("pointerup", (event) => this.up(event));
    on("pointercancel", () => { this.held = null; });
    on("pointerleave", () => { this.ring.setAttribute("display", "none"); });
    on("wheel", (event) => { event.preventDefault(); app.zoom(Math.exp(-event.deltaY / 500), app.diagram.under(event)); }, { passive: false });
    on("dblclick", () => app.zoom(0));
    new MutationObserver(() => this.ring.setAttribute("display", "none")).observe(svg, { attributes: true, attributeFilter: ["viewBox"] });
  }

  /** A place in the picture [m] under the pointer, and how far the hand reaches there. */
  at(event) {
    const { diagram } = this.app;
    return { here: diagram.from(diagram.under(event)), reach: NEAR / (diagram.k * diagram.scale) };
  }

  /** The point nearest to the pointer among some; null where none is near. */
  nearest(names, { here, reach }) {
    const { app } = this, places = app.now();
    let found = null, best = reach;
    for (const name of names) {
      if (!places[name]) continue;
      const there = app.diagram.flat(places[name]), apart = Math.hypot(there[0] - here[0], there[1] - here[1]);
      if (apart < best) [best, found] = [apart, name];
    }
    return found;
  }

  /** What would be dragged from there. */
  grip(where) {
    const { app } = this, { session, data } = app;
    if (!session.live) return null;
    if (app.shape && app.shape.checked) {
      const shaped = this.nearest(Object.keys(app.now()).filter((name) => slidersAt(data, name).length), where);
      return shaped && { shaped, name: shaped };
    }
    const moving = data.entries.filter(({ kind, columns }) => kind === "points" && (app.several || session.moving(columns)));
    const name = this.nearest(moving.map(({ part }) => part), where);
    return name && { name, columns: moving.find(({ part }) => part === name).columns };
  }

  down(event) {
    const { app } = this, { svg } = app.diagram;
    if (event.button) return;
    app.session.settle();
    const grip = this.grip(this.at(event));
    this.held = { grip, from: [event.clientX, event.clientY], last: [event.clientX, event.clientY], moved: false, target: event.target };
    svg.setPointerCapture(event.pointerId);
  }

  move(event) {
    const { app, held } = this, { diagram } = app;
    if (!held) { this.hover(event); return; }
    const [x, y] = [event.clientX, event.clientY];
    if (!held.moved && Math.hypot(x - held.from[0], y - held.from[1]) < STILL) return;
    if (!held.moved && held.grip && (held.grip.shaped || app.several)) app.session.remember();
    held.moved = true;
    const { here } = this.at(event), { grip } = held;
    diagram.svg.style.cursor = "grabbing";
    if (grip && grip.shaped) app.want({ pulled: [grip.shaped, here] });
    else if (grip && app.several) app.want({ reached: [grip.columns, here] });
    else if (grip) this.pull(grip.columns, here);
    else if (app.data.scene.space && !event.shiftKey) app.turnView((held.last[0] - x) / 2, (y - held.last[1]) / 2);
    else app.pan((x - held.last[0]) / diagram.k, (y - held.last[1]) / diagram.k);
    held.last = [x, y];
  }

  up(event) {
    const { held, app } = this;
    this.held = null;
    app.diagram.svg.style.cursor = "";
    if (held && !held.moved) this.click(held, event);
  }

  /** Show that a point can be taken. */
  hover(event) {
    const { app } = this, { diagram } = app, grip = event.pointerType === "touch" ? null : this.grip(this.at(event));
    diagram.svg.style.cursor = grip ? "grab" : "";
    this.ring.setAttribute("display", grip ? "inline" : "none");
    if (!grip) return;
    const [cx, cy] = diagram.at(app.now()[grip.name]);
    for (const [name, value] of Object.entries({ cx, cy })) this.ring.setAttribute(name, value.toFixed(2));
  }

  /** A click chooses what is under it for the curves: a point, a joint, a link. */
  click({ target }, event) {
    const { app } = this, { curves, data } = app;
    if (!curves) return;
    const name = this.nearest(Object.keys(app.now()), this.at(event));
    const marked = target.closest && target.closest("[data-id]"), [kind, part] = marked ? marked.getAttribute("data-id").split("-") : [];
    const joint = data.scene.joints.find(({ first, second }) => name && [first, second].includes(name));
    if (app.efforts && app.tabs.shown === "forces" && joint) { app.efforts.toggle(app.efforts.of("joints", joint.name)); return; }
    const slides = joint && curves.of("joints", joint.name), block = kind === "joint" && part && !data.scene.joints.find((own) => own.name === part)?.pin;
    const thing = (block && curves.of("joints", part)) || (name && (curves.of("points", name) || slides)) || (["body", "number"].includes(kind) && curves.of("bodies", part)) || (kind === "joint" && curves.of("joints", part));
    if (!thing) return;
    app.tabs.show("curves");
    curves.toggle(thing);
    light(`thing-${thing.parts[0]}`);
  }

  /** The place nearest to the pointer on the part of the path around the present one. */
  pull(columns, here) {
    const { app } = this, { session } = app, { places, poses } = session;
    const count = places.length, span = session.range[1] - session.range[0];
    const now = Math.round(((session.s - session.range[0]) / span) * (count - 1));
    const { round } = session.motion;
    const apart = (k) => {
      const index = round ? ((k % (count - 1)) + count - 1) % (count - 1) : k;
      const pose = poses[index];
      if (!pose || !pose.y) return Infinity;
      const there = app.diagram.flat(columns.map((column) => pose.y[0][column]));
      return (there[0] - here[0]) ** 2 + (there[1] - here[1]) ** 2;
    };
    let best = now;
    for (const way of [1, -1]) { // only as far as the way there is assembled
      for (let k = now; Math.abs(k - now) <= 30 && apart(k) < Infinity; k += way) if (apart(k) < apart(best)) best = k;
    }
    const [a, b, c] = [apart(best - 1), apart(best), apart(best + 1)], bend = a - 2 * b + c;
    const between = bend > 0 && Number.isFinite(bend) ? Math.max(-0.5, Math.min(0.5, (a - c) / (2 * bend))) : 0;
    app.want({ s: session.inside(session.range[0] + (span * (best + between)) / (count - 1)) });
  }

  /** Change the dimensions that place a point so that it comes to where it is pulled. */
  reshape([name, place]) {
    const { session, dimensions } = this.app, theta = pulled(session, name, place);
    if (!theta) return;
    const wanted = session.theta.map((value, k) => (theta[k] !== value ? k : -1)).filter((k) => k >= 0);
    const t = session.dimension(theta);
    theta.forEach((_, k) => dimensions.rows[k].say(t === 1 || !wanted.includes(k) ? "" : session.reason));
  }
}
