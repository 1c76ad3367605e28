/** Which link turns: Grashof's inequality of a four-bar, that of a slider-crank, and where the driver ends. */
import { find, made } from "./made.js";
import { sentence, words } from "./words.js";
import { quantity } from "./units.js";

/** Lengths that differ by less than this share of them are equal. */
const EQUAL = 1e-9;

/** Lengths of a four-bar in the order driven link, coupler, last link, ground; of a slider-crank crank, rod, offset. Null of others. */
function barsOf(session) {
  const { bars } = session.data.lesson;
  const pose = session.poses.find((own) => own.y), places = pose && session.places_of(pose);
  if (!bars || !pose) return null;
  const lengths = bars.bars.map(([name, a, b]) => ({ name, length: Math.hypot(places[b][0] - places[a][0], places[b][1] - places[a][1]) }));
  if (!bars.slide) return lengths;
  const { first, axis } = session.data.scene.joints.find(({ name }) => name === bars.slide), pivot = places[bars.bars[0][1]];
  if (!first.startsWith("ground.") || axis === undefined) return null;
  const pin = places[bars.bars[1][2]], off = (pin[1] - pivot[1]) * Math.cos(axis) - (pin[0] - pivot[0]) * Math.sin(axis);
  return [...lengths, { name: "e", length: Math.abs(off) }];
}

/** What is said of the lengths of a four-bar: the key of the sentence and the shortest link. */
export function classOf(bars) {
  const order = [...bars].sort((a, b) => a.length - b.length), [s, p, q, l] = order.map(({ length }) => length);
  const room = p + q - s - l;
  if (Math.abs(room) <= EQUAL * (p + q)) return { key: "change_point", s, p, q, l, shortest: order[0] };
  const at = bars.indexOf(order[0]);
  return { key: room < 0 ? "triple_rocker" : ["crank_turns", "coupler_turns", "crank_turns", "frame_short"][at], s, p, q, l, shortest: order[0] };
}

/** The sentence on what turns, with the numbers of the pose. */
export function turning(app) {
  const { session } = app, bars = barsOf(session), said = [];
  if (bars && bars.length === 4) {
    const { key, s, p, q, l, shortest } = classOf(bars);
    said.push(sentence(key, quantity(s + l, "m", 5), quantity(p + q, "m", 5), shortest.name));
  } else if (bars) {
    const [r, rod, e] = bars.map(({ length }) => length), apart = rod - r - e;
    const key = Math.abs(apart) <= EQUAL * rod ? "slider_equal" : apart > 0 ? "slider_turns" : "slider_rocks";
    said.push(sentence(key, quantity(r + e, "m", 5), quantity(rod, "m", 5), bars[0].name));
  }
  const { way, ends } = session.motion, name = words(way.name);
  const value = (s) => quantity(Math.abs(s) < EQUAL * (way.turns ? 1 : session.data.start.scale) ? 0 : s, way.unit, 5);
  const open = ends.filter((end) => end && end.kind === "limit"), [low, high] = session.range.map((s, k) => (ends[k] ? ends[k].s : s));
  if (open.length) {
    const same = open.length > 1 && open[0].group === open[1].group && open[0].joint === open[1].joint;
    const where = same ? [sentence("opens_both", open[0].group, open[0].joint)] : open.map(({ group, joint, s }) => sentence("opens_there", value(s), group, joint));
    said.push(sentence("driver_between", name, value(low), value(high)), ...where);
  } else if (way.turns && !bars && high - low > 2 * Math.PI * (1 - EQUAL)) said.push(sentence("driver_turns", name));
  return said.join("; ");
}

/** Grashof's strip: shortest and longest beside the two others. */
export class Strip {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    const bars = barsOf(app.session);
    if (!bars || bars.length < 4) return;
    this.box = made("figure", { class: "strip", "aria-label": words("grashof") });
    find("dimensions").append(this.box);
  }

  whole() {
    if (!this.box) return;
    const bars = barsOf(this.app.session), own = bars && classOf(bars);
    if (!own) return;
    const order = [...bars].sort((a, b) => a.length - b.length), most = Math.max(own.s + own.l, own.p + own.q);
    const named = ({ name }) => (name === "ground" ? words("frame") : name);
    const row = (title, parts) => made("div", { class: "strip-row" }, made("span", {}, title), made("div", { class: "strip-bar" }, ...parts.map((bar, k) => made("span", { class: `strip-part p${k}`, style: `width:${((100 * bar.length) / most).toFixed(2)}%`, title: `${named(bar)} ${quantity(bar.length, "m", 5)}` }, named(bar)))),
      made("span", { class: "strip-sum" }, quantity(parts[0].length + parts[1].length, "m", 4)));
    this.box.replaceChildren(made("figcaption", {}, words("grashof")), row("s + l", [order[0], order[3]]), row("p + q", [order[1], order[2]]));
  }
}
