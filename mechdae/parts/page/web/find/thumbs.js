/** Thumbnails: a mechanism that was found, with what is asked for and what it is. */
import { made } from "../made.js";
import { digits } from "../units.js";
import { element, pathOf } from "../view.js";
import { words } from "../words.js";

const SIZE = [132, 96];

/** Places of a polyline (x, y, x, y, ...). */
export const pairs = (z) => Array.from({ length: z.length / 2 }, (_, k) => [z[2 * k], z[2 * k + 1]]);

/** Places in metres to units of a thumbnail. */
function fitted(places) {
  const low = [0, 1].map((k) => Math.min(...places.map((own) => own[k]))), high = [0, 1].map((k) => Math.max(...places.map((own) => own[k])));
  const scale = Math.min(...SIZE.map((side, k) => (side - 16) / (high[k] - low[k] || 1)));
  return ([x, y]) => [SIZE[0] / 2 + scale * (x - (low[0] + high[0]) / 2), SIZE[1] / 2 - scale * (y - (low[1] + high[1]) / 2)];
}

/** What stands below the picture. */
function aboutOf({ facts, order, error, miss, good }) {
  const lines = [facts.ratio ? `${words(facts.class)} (i = ${facts.ratio})` : words(facts.class), `μ ≥ ${digits((facts.angle * 180) / Math.PI, 2)}°`];
  if (order) lines.push(facts.branch === false ? words("find_branches") : order.join(" "));
  if (error !== undefined) lines.push(`${words("find_error")} ${digits(100 * (miss ?? error), 2)} %`);
  if (miss !== undefined && facts.branch !== false) lines.push(words(good ? "find_checked" : "find_open"));
  return lines.join(", ");
}

/** A button with the picture of a solution. @param {any} solution @param {number[][]} wanted poses, points or places of the curve @param {string} kind which of these
 * @param {boolean} pressed @param {() => void} act */
export function thumbOf(solution, wanted, kind, pressed, act) {
  const { drawing, way } = solution, nodes = new Map(drawing.nodes.map(({ id, x, y }) => [id, [x, y]]));
  const at = fitted([...nodes.values(), ...(kind === "poses" ? wanted : []), ...(way ? pairs(way) : [])]);
  const svg = element("svg", { viewBox: `0 0 ${SIZE.join(" ")}`, width: SIZE[0], height: SIZE[1], "aria-hidden": "true" });
  if (kind === "curve") element("path", { d: pathOf(wanted.map(at), true), class: "wanted" }, svg);
  if (way) element("path", { d: pathOf(pairs(way).map(at), true), class: "trace" }, svg);
  for (const { nodes: ids } of drawing.links) element("path", { d: pathOf(ids.map((id) => at(nodes.get(id))), ids.length > 2), class: "body" }, svg);
  for (const { x, y, fixed, slide } of drawing.nodes) {
    const [cx, cy] = at([x, y]);
    if (slide) element("path", { d: pathOf([-30, 30].map((far) => [cx + far * Math.cos(slide.angle), cy - far * Math.sin(slide.angle)])), class: "guide" }, svg);
    element("circle", { cx, cy, r: fixed ? 3.4 : 2.4, class: fixed ? "fixed" : "free" }, svg);
  }
  if (kind === "poses") for (const pose of wanted) { const [x, y] = at(pose); element("path", { d: `M${x} ${y}l${12 * Math.cos(pose[2])} ${-12 * Math.sin(pose[2])}`, class: "wanted" }, svg); }
  else if (kind === "points") for (const point of wanted) { const [cx, cy] = at(point); element("circle", { cx, cy, r: 2, class: "wanted" }, svg); }
  const doubtful = solution.miss !== undefined && !solution.good;
  return made("button", { type: "button", class: doubtful ? "linkage warn" : "linkage", "aria-pressed": String(pressed), onclick: act }, svg, made("span", {}, aboutOf(solution)));
}
