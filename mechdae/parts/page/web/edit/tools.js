/** The tools of the editor: what a press, a move and a release of the pointer do. Ends are `{node}`, `{link, place}` or `{place}`. */
import { bodyOf } from "./mechanism.js";
import { reflected } from "./mirror.js";
import { Refused } from "../read_toml.js";

/** The reference of an end, a point that is made where there is none: on a link, else (`ground`) on the ground. */
function pointAt(sketch, { node, link, place }, ground = true) {
  if (node) return node.id;
  if (link) return sketch.point(link, sketch.letter(), sketch.local(link, place).map((value) => sketch.rounded(value)));
  if (!ground) throw new Refused("no_point");
  return sketch.grounded(place.map((value) => sketch.rounded(value)));
}

/** An end as a node that is there: what had to be made is part of the same gesture. */
function nodeAt(sketch, end) {
  const reference = pointAt(sketch, end);
  if (!end.node) sketch.load(sketch.toml.text, new Map(sketch.mechanism.bodies.map(({ name }) => [name, sketch.frame(name)])));
  return sketch.nodeOf.get(reference);
}

/** A tool of two clicks on points. */
const between = (act) => ({
  down(editor, end) {
    if (!editor.begun) { editor.begun = end; return; }
    const from = editor.begun;
    editor.begun = null;
    editor.edit(() => { const a = nodeAt(editor.sketch, from), b = nodeAt(editor.sketch, end.node ? { node: editor.sketch.nodeOf.get(end.node.id) } : end); return act(editor.sketch, editor.sketch.nodeOf.get(a.id), b); });
  },
});

/** A tool of a press, a way and a release: what is at the press, where that is, the way, whether it is short. */
const pulled = (act, somewhere = false) => ({
  down(editor, end) { editor.begun = end; },
  up(editor, place) {
    const from = editor.begun, at = from.node ? [from.node.x, from.node.y] : from.place, way = [place[0] - at[0], place[1] - at[1]];
    editor.begun = null;
    editor.edit(() => {
      const node = from.node || (from.link && !somewhere && nodeAt(editor.sketch, from));
      if (!node && !somewhere) throw new Refused("no_point");
      return act(editor, node || at, way, Math.hypot(...way) < 8 / editor.diagram.scale);
    });
  },
});

const rightAngles = (angle) => { const step = Math.PI / 36; return Math.round(angle / step) * step; };

export const TOOLS = {
  select: {
    down(editor, { node, link, place }, event) {
      editor.select(node ? { node: node.id } : link ? { link } : null);
      editor.begun = node ? { dragged: node.id } : { from: editor.diagram.under(event), at: place, panned: true };
    },
    move(editor, place, event) {
      const { begun, sketch } = editor;
      if (begun.panned) { editor.pan(begun); return; }
      const other = editor.nearNode(event, begun.dragged), node = sketch.nodeOf.get(begun.dragged);
      editor.edit(() => sketch.move(node, other ? [other.x, other.y] : place), { during: true });
    },
    up(editor, place, event) {
      const { begun, sketch } = editor, other = begun.dragged && begun.moved && editor.nearNode(event, begun.dragged);
      editor.begun = null;
      if (other) editor.edit(() => sketch.merge(sketch.nodeOf.get(begun.dragged), other));
      else if (begun.moved && begun.dragged) { sketch.done(); editor.changed(); }
    },
  },
  link: {
    down(editor, end) {
      const { begun } = editor;
      if (!begun) {
        editor.begun = end;
        if (end.link) { // a point of that link, whatever follows
          let made = null;
          editor.edit(() => { made = pointAt(editor.sketch, end); });
          editor.begun = made ? { node: editor.sketch.nodeOf.get(made) } : null;
        }
        return;
      }
      editor.begun = null;
      let ends = null;
      editor.edit(() => {
        const { sketch } = editor, at = (own) => (own.node || own.link ? { reference: pointAt(sketch, own) } : own);
        if (end.link) end.node = nodeAt(sketch, end);
        const made = sketch.link(at(begun), at(end));
        ends = made.ends;
        return made.frames;
      });
      if (ends) editor.begun = { node: editor.sketch.nodeOf.get(ends[1]) };
    },
  },
  point: {
    down(editor, { node, place }) {
      const link = !node && editor.nearestLink(place);
      if (link) editor.edit(() => { pointAt(editor.sketch, { link, place }); });
      else editor.refuse(node ? "point_there" : "no_link");
    },
  },
  pivot: {
    down(editor, end) {
      editor.edit(() => {
        if (!end.node && !end.link) { pointAt(editor.sketch, end); return; }
        editor.sketch.pivot(nodeAt(editor.sketch, end));
      });
    },
  },
  slider: pulled((editor, node, [x, y], short) => {
    const angle = short ? (editor.shift ? Math.PI / 2 : 0) : editor.shift ? Math.atan2(y, x) : rightAngles(Math.atan2(y, x));
    return editor.sketch.slider(node, short && node.guide ? null : angle);
  }),
  slot: {
    down(editor, { node, link }) {
      const { begun } = editor;
      if (begun && link && (!node || node.id !== begun.node.id)) {
        editor.begun = null;
        editor.edit(() => editor.sketch.slot(begun.node, link));
      } else if (node) editor.begun = { node };
      else editor.refuse("no_point");
    },
  },
  ...Object.fromEntries(["bar", "cylinder", "gear", "belt", "rack", "cam", "spring"].map((kind) => [kind, between((sketch, a, b) => (kind === "belt" ? sketch.gear(a, b, kind) : sketch[kind](a, b)))])),
  force: pulled((editor, node, way, short) => editor.sketch.force(node, short ? [0, -100] : way.map((value) => Math.round((100 * value) / Math.hypot(...way))))),
  mirror: pulled((editor, at, [x, y], short) => reflected(editor.sketch, at.id ? [at.x, at.y] : at, short ? Math.PI / 2 : rightAngles(Math.atan2(y, x))), true),
  weld: { down(editor, { node }) { if (node) editor.edit(() => editor.sketch.weld(node)); else editor.refuse("no_point"); } },
  driver: {
    down(editor, { node, link, near }) {
      const { sketch } = editor, body = link || near || (node && (node.refs.map(bodyOf).find((own) => own !== "ground" && sketch.mechanism.pointsOf(own).size > 1) ?? null));
      const { joint } = editor.strokeUnder || {}, guide = (node && node.guide) || (joint && joint.kind === "prismatic" && joint);
      if (!guide && !body) { editor.refuse("no_driver_there"); return; }
      editor.edit(() => sketch.lead(guide ? `${guide.name}.slide` : `${body}.angle`));
    },
  },
  delete: {
    down(editor, { node, link }) {
      const { strokeUnder: stroke } = editor;
      if (node || link || stroke) editor.remove({ node, link, stroke }); else editor.refuse("nothing_there");
    },
  },
  measure: {
    down(editor, { place }) {
      if (!editor.begun) { editor.begun = { place }; return; }
      const [from, length] = [editor.begun.place, editor.measured];
      editor.begun = null;
      if (editor.backdrop.photo && length > 0 && Math.hypot(place[0] - from[0], place[1] - from[1]) > 0) editor.backdrop.scaled(from, place, length);
      editor.draw();
    },
  },
};
