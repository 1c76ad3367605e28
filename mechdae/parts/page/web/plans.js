/** Vector polygons of the pose shown: velocities and accelerations from their pole, forces on one body. */
import { arrow, element } from "./view.js";
import { digits } from "./units.js";

export class Plans {
  /** @param {HTMLElement} place @param {any} session @param {(key: string) => string} words @param {any} made @param {() => void} redraw */
  constructor(place, session, words, made, redraw) {
    this.session = session;
    this.words = words;
    const options = [["", "–"], ["velocity", words("velocity")], ["acceleration", words("acceleration")]];
    if (session.forces) for (const { name } of session.data.scene.bodies) options.push([`forces ${name}`, `${words("acting")} ${name}`]);
    this.choice = made("select", { "aria-label": words("plans"), onchange: () => redraw() }, ...options.map(([value, text]) => made("option", { value }, text)));
    this.svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    this.svg.setAttribute("role", "img");
    this.svg.setAttribute("aria-label", words("plans"));
    this.svg.setAttribute("style", "width:100%;height:260px;display:none");
    place.append(made("fieldset", {}, made("legend", {}, words("plans")), this.choice, this.svg));
  }

  draw(pose, forces) {
    const what = this.choice.value;
    this.svg.style.display = what ? "block" : "none";
    this.svg.replaceChildren();
    if (!what) return;
    const plan = what.startsWith("forces ") ? this.polygon(what.slice(7), forces) : this.rates(pose, what === "velocity" ? 1 : 2);
    if (plan) this.picture(plan);
    else element("text", { x: 12, y: 24, class: "tick" }, this.svg).textContent = this.words("none");
  }

  /** Images of the points: vectors from the pole, and those between points of one body. */
  rates(pose, order) {
    const { session } = this;
    const images = {};
    for (const { kind, part, columns } of session.data.entries) {
      const found = kind === "points" ? session.inTime(pose, columns, order) : null;
      if (found && found.every(Number.isFinite)) images[part] = found;
    }
    const size = Math.max(0, ...Object.values(images).map((own) => Math.hypot(...own)));
    if (!(size > 0)) return null;
    const arrows = [], lines = [], letters = [{ text: "p", at: [0, 0] }];
    const drawn = [];
    for (const [name, own] of Object.entries(images)) {
      if (Math.hypot(...own) < 1e-9 * size) continue;
      const letter = name.split(".")[1].toLowerCase();
      const same = drawn.find((other) => Math.hypot(other.at[0] - own[0], other.at[1] - own[1]) < 1e-6 * size);
      if (same) {
        if (!same.text.split(", ").includes(letter)) same.text += `, ${letter}`;
        continue;
      }
      arrows.push({ from: [0, 0], to: own, kind: order === 1 ? "velocity" : "force" });
      drawn.push({ text: letter, at: own });
    }
    for (const body of session.data.scene.bodies) {
      const own = Object.entries(images).filter(([name]) => name.split(".")[0] === body.name).map(([, image]) => image);
      for (let k = 1; k < own.length; k += 1) lines.push([own[k - 1], own[k]]);
      if (own.length > 2) lines.push([own[own.length - 1], own[0]]);
    }
    return { arrows, lines, letters: [...letters, ...drawn], unit: order === 1 ? "m/s" : "m/s²" };
  }

  /** Reactions on a body head to tail; what closes them are loads, inertia and the drive. */
  polygon(body, forces) {
    if (!forces || forces.status === "jammed") return null;
    const arrows = [], letters = [];
    let here = [0, 0];
    for (const joint of this.session.data.scene.joints) {
      const own = forces.reactions[joint.name];
      const sign = joint.second.split(".")[0] === body ? 1 : joint.first.split(".")[0] === body ? -1 : 0;
      if (!own || !sign) continue;
      const next = [here[0] + sign * own[0], here[1] + sign * own[1]];
      arrows.push({ from: here, to: next, kind: "force" });
      letters.push({ text: joint.name, at: [(here[0] + next[0]) / 2, (here[1] + next[1]) / 2], across: [sign * own[0], sign * own[1]] });
      here = next;
    }
    const size = Math.max(0, ...arrows.map(({ from, to }) => Math.hypot(to[0] - from[0], to[1] - from[1])));
    if (!(size > 0)) return null;
    if (Math.hypot(...here) > 1e-9 * size) {
      arrows.push({ from: here, to: [0, 0], kind: "rest" });
    }
    return { arrows, lines: [], letters, unit: "N", note: `– – ${this.words("rest")}` };
  }

  /** Draw a plan to the largest scale of 1, 2, 5 that fits. */
  picture({ arrows, lines, letters, unit, note = "" }) {
    const { width, height } = this.svg.getBoundingClientRect();
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const every = [[0, 0], ...arrows.flatMap(({ from, to }) => [from, to])];
    const [xs, ys] = [0, 1].map((k) => every.map((own) => own[k]));
    const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const fit = Math.min((width - 90) / Math.max(right - left, 1e-300), (height - 70) / Math.max(high - low, 1e-300));
    const power = 10 ** Math.floor(Math.log10(fit));
    const scale = power * [5, 2, 1].find((k) => k * power <= fit * (1 + 1e-12));
    const at = ([x, y]) => [width / 2 + scale * (x - (left + right) / 2), (height - 14) / 2 - scale * (y - (low + high) / 2)];
    for (const [a, b] of lines) {
      const [[x1, y1], [x2, y2]] = [at(a), at(b)];
      element("line", { x1, y1, x2, y2, class: "relative" }, this.svg);
    }
    for (const { from, to, kind } of arrows) {
      const [a, b] = [at(from), at(to)];
      const size = Math.hypot(b[0] - a[0], b[1] - a[1]);
      if (size > 1) arrow(this.svg, a, [b[0] - a[0], b[1] - a[1]], size, kind);
    }
    for (const { text, at: place, across } of letters) {
      const [x, y] = at(place);
      const size = across ? Math.hypot(...across) : 0; // beside a vector, on its left
      const [dx, dy] = size > 0 ? [(-12 * across[1]) / size, (-12 * across[0]) / size] : [5, -5];
      element("text", { x: x + dx, y: y + dy + (size > 0 ? 4 : 0), class: "letter", "text-anchor": size > 0 ? "middle" : "start" }, this.svg).textContent = text;
    }
    const length = 50 / scale;
    element("text", { x: 8, y: height - 6, class: "tick" }, this.svg).textContent = `50 px = ${digits(length, 4)} ${unit}   ${note}`;
  }
}
