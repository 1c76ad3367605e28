"""The writer of SVG: a scene as fragments that a page moves with points and bodies.

A fragment that is rigid is markup in its own frame; of others each corner is told by the places it
keeps its way to. Places of labels are chosen once, where they cover least in all poses.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby, pairwise
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.joints.curve import follows_curve
from mechdae.describe.joints.joint import Joint
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.diagram import DrawnPose, View, extent
from mechdae.draw.diagram.driver import SPAN
from mechdae.draw.diagram.guides import guide_ends, travel
from mechdae.draw.diagram.loads import GRAVITY, Mark, peak_force
from mechdae.draw.diagram.places import AnyScene
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.diagram.wheels import rack_span, rack_travel
from mechdae.draw.labels.labels import Links, Writing
from mechdae.draw.labels.steady import AnchorFrame, SteadyLabels, chosen_labels, compared
from mechdae.draw.load_states import load_states
from mechdae.draw.poses import Seen, seen
from mechdae.draw.primitives import PAPER, Anchor, Array, Primitive, path_of
from mechdae.draw.sheet import Sheet, arc
from mechdae.draw.space.solids import Item
from mechdae.draw.space.spatial_drawing import SpatialFrame, SpatialView, spatial_anchors
from mechdae.draw.space.spatial_drivers import with_head
from mechdae.draw.space.spatial_pose import SpatialPose, anchored
from mechdae.draw.words import Words
from mechdae.types import Json

if TYPE_CHECKING:
    from mechdae.results import SweepResult

LENGTH = 60.0
"""Of spans that are templates."""
NAMES = {
    style.INK: "ink", style.PAPER: "paper", style.DRIVEN: "driven", style.ARROW: "arrow",
    style.FILL: "fill", style.WHEEL: "wheel", style.GROUND: "ground", style.LOAD: "load",
    style.FAINT: "faint",
}  # fmt: skip
"""What colours are called in the page's style sheet."""


def fragments(result: SweepResult, shares: Array, lang: str = "en") -> tuple[Json, Json]:
    """Return from where a motion is seen, nothing in the plane, and its scene as fragments.

    ``shares`` are those of the way at all poses. In the scene,
    ``parts``: see `FragmentWriter`, in space those of labels; ``traces``: points whose paths are
    drawn; ``reach``: of guides and racks least and greatest slide [m]; ``loads``: how loads act
    along the poses; ``solids``: what is drawn in space, see `_solids`; ``along``: places along axes
    by name: a point, a body, a direction in it, how far [m].
    """
    shown = seen(result)
    known = shown.scene.assembled() or [shown.pose]
    some = compared(known, shown.pose)
    view = replace(
        shown.view, bounds=shown.bounds(some, True), peak=peak_force(shown.scene, result, some),
        memory={}, larger=style.PAGE,
    )  # fmt: skip
    sheet, drawn, labels = steady_labels(shown, some, view, Words(lang))
    order = sorted(known, key=lambda k: shares[k])
    if isinstance(view, SpatialView):
        space, drawing = _in_space(shown, view, order, sheet, drawn, labels, shares)
    else:
        space, drawing = _in_plane(shown, view, order, sheet, drawn, labels, shares)
    return space, drawing | {"traces": list(shown.scene.paths)}


def _in_plane(
    shown: Seen, view: View, order: Sequence[int], sheet: Sheet, drawn: DrawnPose,
    labels: SteadyLabels, shares: Array,
) -> tuple[Json, Json]:  # fmt: skip
    """Return nothing, for it is seen from above, and the scene as fragments."""
    scene, result, pose = shown.scene, shown.result, shown.pose
    assert view.bounds is not None

    def ends_of(gid: str) -> Array | None:
        for shaft, head in pairwise(sheet.drawn):
            if shaft.gid == gid and shaft.kind == "line":
                frame = FragmentFrame(sheet, scene, pose, shaft.anchor)
                return frame.local(np.array([shaft.points[0], head.points[0]]))
        return None

    loads = load_states(scene, result, pose, order, view.peak or 1.0, ends_of)
    _beside(labels, sheet, pose, loads).write(sheet, pose, _texts(drawn.marks, loads), shares)
    writer = FragmentWriter(sheet, lambda anchor: FragmentFrame(sheet, scene, pose, anchor))
    reach = {
        joint.name: _reach(scene, joint, pose, view.bounds[2])
        for joint in scene.joints(pose)
        if joint.straight or joint.wheels == 1
    }
    return {}, {"parts": list(writer.parts()), "reach": reach, "loads": loads}


def _in_space(
    shown: Seen, view: SpatialView, order: Sequence[int], sheet: Sheet, drawn: DrawnPose,
    labels: SteadyLabels, shares: Array,
) -> tuple[Json, Json]:  # fmt: skip
    """Return from where it is seen, and the scene: solids, labels, springs and masses."""
    scene, index, eye = shown.scene, shown.pose, view.viewpoint
    pose = view.pose(sheet, scene, index)
    sheet.drawn[:] = [shape for shape in sheet.drawn if shape.anchor.points]  # not the items
    solids = list(_solids(_with_gravity(drawn, pose), pose))
    ends = partial(_ends, solids)
    loads = load_states(scene, shown.result, index, order, view.peak or 1.0, ends)
    labels.write(sheet, index, _texts(drawn.marks, loads), shares)
    writer = FragmentWriter(sheet, partial(SpatialFrame, view, sheet, scene, index))
    drawing = {
        "solids": solids,
        "along": {name: [*row[:2], row[2].tolist(), row[3]] for name, row in pose.along.items()},
        "parts": list(writer.parts()),
        "loads": loads,
    }
    space = {"azimuth": eye.azimuth, "elevation": eye.elevation, "up": list(eye.upward)}
    return {"space": space}, drawing


def _texts(marks: Sequence[Mark], loads: Json) -> list[Mark]:
    """Return what is written at loads: no sizes that change."""
    changing = {
        name
        for name, load in loads.items()
        if load["varies"] or any(row[-2:] != [1, 1] for row in load["rows"])
    }
    return [replace(mark, text=mark.name) if mark.name in changing else mark for mark in marks]


def steady_labels(
    shown: Seen, poses: Sequence[int], view: View, words: Words
) -> tuple[Sheet, DrawnPose, SteadyLabels]:
    """Return the first pose without labels, what is drawn, and labels with places for all poses."""
    scene, larger = shown.scene, view.larger
    low, high, _ = view.bounds or view.room(scene, poses, view.traces)
    sheets = [Sheet(None, low, high, memory=view.memory, larger=larger) for _ in poses]
    drawn = [
        view.draw(sheet, scene, shown.result, k, words, ordered=False)
        for sheet, k in zip(sheets, poses, strict=True)
    ]
    first, frame_of = drawn[0], partial(_frame, view, scene)

    def anchors(label: Writing) -> list[Anchor]:
        if isinstance(view, SpatialView):
            shapes: list[Item | Primitive] = [*first.items, *sheets[0].drawn]
            return spatial_anchors(scene, label, poses[0], shapes, view.moved)
        return anchors_of(scene, label, sheets[0], poses[0], first.links)

    rows = [each.texts for each in drawn]
    return sheets[0], first, chosen_labels(sheets, poses, rows, anchors, frame_of)


def _frame(view: View, scene: AnyScene, sheet: Sheet, pose: int, anchor: Anchor) -> AnchorFrame:
    if isinstance(view, SpatialView):
        return SpatialFrame(view, sheet, scene, pose, anchor)
    return FragmentFrame(sheet, scene, pose, anchor)


def anchors_of(
    scene: DrawnScene, label: Writing, sheet: Sheet, pose: int, links: Links
) -> list[Anchor]:
    """Return what a label may move with: a place, upright or turning with a body there."""
    kind, _, name = label.gid.partition("-")
    if kind == "number":
        body = scene.mechanism.bodies[name]
        points = tuple(f"{name}.{point}" for point in body.points)
        beside = links.bars.get(name) or name in links.polygons
        return [Anchor(points, name if beside else "")]
    if name.startswith("load-"):
        held = [
            shape.anchor for shape in sheet.drawn if shape.gid in (name, name.removeprefix("load-"))
        ]
        return [Anchor(held[0].points, held[0].turn) if held else PAPER]
    place = scene.place(name, pose)
    near = [
        body
        for body in scene.mechanism.bodies
        if scene.shown(body, pose)
        for point in scene.points(body)
        if np.allclose(scene.place(point, pose), place, atol=1e-9)
    ]
    return [Anchor((name,)), *(Anchor((name,), body) for body in near)]


def _reach(scene: DrawnScene, joint: Joint, pose: int, size: float) -> list[float]:
    if joint.straight:
        return list(travel(scene, joint, pose, size))
    along = rack_travel(scene, joint)
    return [float(np.nanmin(along)), float(np.nanmax(along))]


def _ends(solids: Sequence[Json], gid: str) -> Array | None:
    """Return start and tip of an arrow in the frame that it turns with."""
    shapes = [shape for part in solids if part["id"] == gid for shape in part["shapes"]]
    ways = {kind: np.reshape(row, (-1, 3)) for kind, _, _, row in reversed(shapes)}
    return np.array([ways["line"][0], ways["head"][1]]) if {"line", "head"} <= set(ways) else None


def _with_gravity(drawn: DrawnPose, pose: SpatialPose) -> list[Item]:
    """Return what is drawn in space, with the arrow of gravity as one that turns with the view."""
    items: list[Item] = [*drawn.items]
    pull = np.array([pose.scene.numbers.get(f"gravity.{axis}", 0.0) for axis in "xyz"])
    for mark in drawn.marks:
        if mark.name == "gravity":
            middle = np.mean(mark.lines[0], axis=0)
            ways = np.linspace(-0.5, 0.5, 11)[:, None] * GRAVITY * pull / np.linalg.norm(pull)
            points = np.array([*middle, 0.0]) + pose.view.seen(ways)
            held = Anchor(spot=(float(middle[0]), float(middle[1])))
            items += anchored(with_head(points, "gravity", style.FAINT), held)
    return items


def _beside(labels: SteadyLabels, sheet: Sheet, pose: int, loads: Json) -> SteadyLabels:
    """Keep labels beside arrows that turn round where they stand, upright those of torques."""
    rows = []
    for label, anchor, ways in labels.labels:
        load = loads.get(label.gid.partition("load-")[2])
        if load and load["along"]:
            ways = ways[[np.abs(ways[:, 0] - pose).argmin()]]
            if "across" in load:
                spot = labels.frame_of(sheet, pose, anchor).placed(ways[:, 1:])
                anchor = Anchor(anchor.points)
                local = labels.frame_of(sheet, pose, anchor).local(spot)
                ways = np.column_stack([ways[:, :1], local])
        rows.append((label, anchor, ways))
    return replace(labels, labels=tuple(rows))


# -- SVG -----------------------------------------------------------------------------------------


class FragmentFrame(AnchorFrame):
    """A frame of the plane, with ends of guides, of joints' axes, of lines between points."""

    def base(self, point: str) -> Array:
        return self.sheet.at(place_of(self.scene, point, self.pose))

    def angle(self, turn: str) -> float:
        name, _, kind = turn.partition("/")
        if not kind:
            return super().angle(name)
        joint = self.scene.mechanism.joints[name]
        if follows_curve(joint):
            return float(self.scene.angles[joint.first_body][self.pose])
        body = joint.second_body if kind == "rack" else joint.first_body
        return float(self.scene.angles[body][self.pose] + self.scene.numbers[f"{name}.axis"])


def place_of(scene: DrawnScene, point: str, pose: int) -> Array:
    """Return a place [m]: of a point, or of an end of a guide's or a rack's way, ``joint/low``."""
    name, _, end = point.partition("/")
    if not end:
        return scene.place(point, pose)
    joint = scene.mechanism.joints[name]
    if end == "curve":
        return scene.place(joint.first, pose)
    which = 0 if end == "low" else 1
    if joint.wheels == 1:
        return rack_span(scene, joint, pose)[which]
    ends = guide_ends(scene, joint, pose, extent(scene, pose, False)[2])
    return np.array(ends[which])


class FragmentWriter:
    """Writes the primitives of a sheet as fragments; ``frame_of`` gives the frame of an anchor."""

    def __init__(self, sheet: Sheet, frame_of: Callable[[Anchor], AnchorFrame]) -> None:
        self.sheet, self.frame_of = sheet, frame_of

    def parts(self) -> Iterator[Json]:
        """Yield the fragments, those below first."""
        order = sorted(self.sheet.drawn, key=lambda shape: shape.z)
        for (anchor, _), group in groupby(order, key=lambda shape: (shape.anchor, shape.z)):
            run = list(group)
            rigid = len(anchor.points) < 2 and not anchor.grow and not anchor.span
            if anchor.points and anchor.points[0].endswith("/curve"):
                rigid = False
            if rigid or anchor.spot is not None:
                for gid, named in groupby(_named(run), key=itemgetter(0)):
                    yield self._rigid(anchor, gid, [shape for _, shape in named])
            else:
                yield from (self._moving(shape) for shape in run)

    def _rigid(self, anchor: Anchor, gid: str, run: Sequence[Primitive]) -> Json:
        """Return markup in the frame of an anchor; what has a ``spot`` does not turn."""
        frame = self.frame_of(anchor)
        part = self._held(frame, gid)
        spot, corner = np.array([anchor.spot or (0.0, 0.0)]), np.zeros(2)
        if not anchor.points:  # of the paper the nearest corner
            far = np.vstack([shape.points for shape in run]).mean(axis=0) > self.sheet.size / 2
            part["paper"], corner = far.astype(int).tolist(), far * self.sheet.size
        if anchor.spot is None:
            places = [frame.local(shape.points) - corner for shape in run]
        else:
            part["spot"] = [_corner(share, np.array(way) - corner) for share, *way in anchor.ways]
            places = [shape.points - spot for shape in run]
        part["shapes"] = [_shape(shape, at) for shape, at in zip(run, places, strict=True)]
        return part

    def _moving(self, shape: Primitive) -> Json:
        """Return a path or circle by its corners: share of the way to the second point, x, y."""
        frame = self.frame_of(shape.anchor)
        part = self._held(frame, shape.gid) | _paint(shape)
        if shape.anchor.points[0].endswith("/curve"):
            return part
        return part | _corners(frame.shares(shape.points), frame.local(shape.points))

    def _held(self, frame: AnchorFrame, gid: str | None) -> Json:
        anchor = frame.anchor
        part: Json = {"id": gid or "", "at": list(anchor.points)}
        if anchor.turn:
            part["turn"] = anchor.turn
        if anchor.span:
            part["span"] = True
        if anchor.grow:
            part["grow"] = [anchor.grow, round(frame.length(anchor.grow), 6)]
        return part


def _named(run: Sequence[Primitive]) -> Iterator[tuple[str, Primitive]]:
    """Yield primitives with what they belong to: heads of arrows are not named."""
    gid = ""
    for shape in run:
        gid = shape.gid or gid
        yield gid, shape


def _corner(share: float, way: Array) -> list[float]:
    """Return a corner of a fragment; y is down."""
    return [round(float(share), 4), round(float(way[0]), 2), round(-float(way[1]), 2) + 0.0]


def _corners(shares: Array, ways: Array) -> Json:
    """Return the corners of a fragment, none where they are at its places."""
    corners = [_corner(*row) for row in zip(shares, ways, strict=True)]
    return {"corners": corners} if any(any(corner) for corner in corners) else {}


def look_of(shape: Any, color: str | None = None) -> str:
    """Return the paint of a primitive or facet: stroke, fill, width, dashes."""
    color = shape.edge if color is None else color
    edge = NAMES[color] if shape.width and color != "none" else "none"
    dash = "" if shape.dash is None else f" {','.join(f'{part:g}' for part in shape.dash[1])}"
    return f"{edge} {NAMES.get(shape.fill, 'none')} {shape.width:g}{dash}"


def _paint(shape: Primitive) -> Json:
    """Return kind and paint of a fragment that is one path or circle."""
    part: Json = {"kind": shape.kind, "look": look_of(shape, shape.color)}
    return part | ({"radius": round(shape.radius, 3)} if shape.kind == "circle" else {})


def _shape(shape: Primitive, points: Array) -> list[object]:
    """Return an element of a rigid fragment: its name, its paint, where it is; y is down."""
    x, y = (round(part, 2) + 0.0 for part in (points[0] * (1, -1)).tolist())
    if shape.kind == "text":
        size, slanted = shape.font.size, shape.font.style == "italic"
        return ["text", NAMES[shape.color], x, y, size, shape.text, slanted, shape.short]
    if shape.kind == "circle":
        return ["circle", look_of(shape, shape.color), x, y, shape.radius]
    return ["path", look_of(shape, shape.color), path_of(shape.kind, points)]


def templates() -> Json:
    """Return the symbols that an editor puts together: shapes, parts of a span, paints.

    Parts with a ``period`` are repeated along their span, and ``beyond`` it.
    """
    sheet, zero, x = Sheet(None, (0.0, 0.0), (1.0, 1.0)), np.zeros(2), np.array([1.0, 0.0])

    def made(draw: Callable[..., None], *places: object) -> list[Primitive]:
        sheet.drawn.clear()
        draw(sheet, *places, "")
        return list(sheet.drawn)

    def shapes(draw: Callable[..., None], *places: object) -> list[list[object]]:
        return [_shape(shape, shape.points) for shape in made(draw, *places)]

    def span(draw: Callable[..., None], *places: object) -> list[Json]:
        """Return primitives between the origin and a place on the right as fragments."""
        drawn = [(own, np.clip(own.points[:, 0] / LENGTH, 0.0, 1.0)) for own in made(draw, *places)]
        return [_paint(own) | _corners(s, own.points - np.outer(s, LENGTH * x)) for own, s in drawn]

    loading = partial(symbols.arrow, color=style.LOAD)
    reach, low = style.BLOCK[0] + 7.0, np.array([0.0, -style.BLOCK[1]])
    wall, strokes = span(symbols.hatch, low - reach * x, low + (reach + LENGTH) * x, symbols.DOWN)
    (foot, *_), (tip, *_) = symbols.hatching(low, low + LENGTH * x, symbols.DOWN)
    stroke = _corners(np.full(2, 0.75), np.array([low, low + tip - foot]))
    pitch, teeth = span(symbols.toothed_line, zero, LENGTH * x, symbols.DOWN)
    tooth = [[k / 4, 0.0, height] for k, (_, _, height) in enumerate(teeth["corners"][1:5])]
    bar = Primitive("line", zero[None], 0.0, None, Anchor(), width=style.BAR)
    disc = replace(bar, kind="circle", fill=style.PAPER, width=style.THIN, radius=style.DISC)
    return {
        "pin": shapes(symbols.pin, zero),
        "dot": shapes(symbols.dot, zero),
        "support": shapes(symbols.support, zero),
        "block": shapes(symbols.block, zero, x),
        "weld": shapes(symbols.weld, zero, ()),
        "arrow": shapes(symbols.arrow, arc(zero, style.ARC, 0.35, 0.35 + SPAN)),
        "travel": shapes(symbols.arrow, np.array([[-16.0, 22.0], [16.0, 22.0]])),
        "disc": _shape(disc, zero[None]),
        "guide": [wall, strokes | stroke | {"period": style.HATCH, "beyond": reach}],
        "slot": span(symbols.slot, zero, LENGTH * x),
        "bar": _paint(bar),
        "driven": _paint(replace(bar, color=style.DRIVEN)),
        "face": _paint(replace(bar, kind="area", color="none", fill=style.FILL)),
        "distance": _paint(replace(bar, width=style.LINE, dash=style.DASHED)),
        "strand": _paint(replace(bar, width=style.LINE)),
        "tube": _paint(replace(bar, kind="area", fill=style.PAPER, width=1.4 * style.LINE)),
        "spoke": _paint(replace(bar, color=style.WHEEL, width=style.THIN)),
        "wheel": _paint(*made(symbols.pitch_circle, zero, 1.0)),
        "roller": _paint(replace(disc, width=style.LINE, radius=1.0)),
        "rim": _paint(*made(symbols.rim, zero, 1.0)),
        "spring": span(symbols.spring, zero, LENGTH * x),
        "rack": [pitch, teeth | {"corners": tooth, "period": symbols.TOOTH}],
        "mass": shapes(symbols.mass_center, zero),
        "force": shapes(loading, np.array([-40.0 * x, zero])),
        "torque": shapes(loading, arc(zero, style.ARC, -0.6, 3.4)),
    }


def _solids(items: Sequence[Item], pose: SpatialPose) -> Iterator[Json]:
    """Yield what is drawn of items: ``at`` the places, ``turn`` what it turns with, ``shapes``.

    A shape is a kind (`mechdae.draw.space.solids.Facet`), a paint, a size and the ways of its
    places from those ``at``, in units; of ``round`` ones by middle, pole and rim.
    """
    for item in items:
        anchor = item.anchor
        bases = np.array([pose.at(pose.base(name)) for name in anchor.points])
        paper = np.array([*(anchor.spot or (0.0, 0.0)), 0.0])
        bases = bases if anchor.points else paper[None]
        turn = pose.view.basis @ pose.turned(anchor.turn)
        part: Json = {"id": item.gid or "", "at": list(anchor.points), "turn": anchor.turn}
        if item.is_face or (item.bridges and not item.closed):
            part["owner"] = item.owner
        if anchor.grow:
            part["grow"] = [anchor.grow, round(_length(anchor, pose), 6)]
        if not anchor.points:  # of the paper the nearest corner, and how far from there
            far = paper[:2] > pose.sheet.size / 2
            part["paper"] = [*far.tolist(), *(paper[:2] - far * pose.sheet.size).round(2).tolist()]
        part["shapes"] = []
        for facet in item.parts:
            each = len(bases) == len(facet.points)
            ways = (facet.points - (bases if each else bases[:1])) @ turn
            kind = f"{facet.kind} round" if facet.round else facet.kind
            row = [round(coordinate, 2) + 0.0 for coordinate in ways.ravel().tolist()]
            part["shapes"].append([kind, look_of(facet), round(facet.size, 2), row])
        yield part


def _length(anchor: Anchor, pose: SpatialPose) -> float:
    if ">" not in anchor.grow:
        return pose.sheet.metre
    a, b = (pose.base(name) for name in anchor.grow.split(">"))
    return float(np.linalg.norm(b - a)) * pose.sheet.metre
