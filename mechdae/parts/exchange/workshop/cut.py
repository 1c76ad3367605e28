"""Writers: outlines of parts as sheets to cut (SVG, in mm) and solids (STL), the list of parts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from xml.sax.saxutils import escape

import numpy as np

from mechdae.describe import GROUND
from mechdae.draw.triangles import triangles
from mechdae.errors import UnavailableError
from mechdae.numerics.polygons import polygon_gaps
from mechdae.parts.exchange.workshop.apart import Motions, Stack, stacked
from mechdae.parts.exchange.workshop.outlines import Bend, Loop, turned
from mechdae.parts.exchange.workshop.plates import (
    RING,
    Kit,
    Plate,
    check_holes,
    hull,
    kit_of,
)
from mechdae.parts.exchange.workshop.teeth import ToothedLoop
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats, Integers, Points

Shape = Loop | ToothedLoop


@dataclass(frozen=True)
class CutPart:
    """What is cut: an outline with holes, how many of it, and where it belongs."""

    name: str
    outline: Shape
    holes: list[Shape] = field(default_factory=list)
    count: int = 1

    def moved(self, turn: float, shift: Floats) -> CutPart:
        """Return it turned about the origin, then moved."""
        holes = [hole.moved(turn, shift) for hole in self.holes]
        return replace(self, outline=self.outline.moved(turn, shift), holes=holes)


def part_of(plate: Plate, kit: Kit) -> CutPart:
    """Return a plate as a part."""
    holes: list[Shape] = [Loop(place[None], kit.hole(pin)) for pin, place in plate.holes.items()]
    holes += [Loop(hull(ends), kit.hole(name)) for name, ends in plate.slots.items()]
    distinct: list[Shape] = []
    for hole in holes:  # several pins at one place are one hole
        if not any(np.array_equal(hole.corners, known.corners) for known in distinct):
            distinct.append(hole)
    if plate.teeth and plate.teeth.inside:
        distinct.append(ToothedLoop(plate.teeth))
    return CutPart(plate.name, plate.outline(kit.sizes.width), distinct)


def ring(kit: Kit) -> CutPart:
    """Return a spacer."""
    here = np.zeros((1, 2))
    return CutPart("spacer", Loop(here, RING * kit.sizes.pin / 2), [Loop(here, kit.sizes.hole)])


MM = 1e3
SPACE = 0.35
"""Space between parts on a sheet, in widths of plates."""
FLAT = 1e-9
"""Area of a triangle of points in line, over the square of the sides of polygons."""
FINER = 6
"""Times that straight sides are halved until a triangulation has them all."""
LETTER, SMALLER = 0.62, 6
"""Width of a letter over its height; how often names are made smaller to fit."""


def svg_cut(motion: ExportedMotion, **given: float) -> dict[str, str]:
    """Return a sheet with all parts at their true size, and the list of parts."""
    kit, stack, _ = _made(motion, given)
    return {"": _sheet(motion, parts_of(kit, stack), kit), "parts.csv": listed(kit, stack)}


def stl(motion: ExportedMotion, **given: float) -> dict[str, str]:
    """Return the assembly in its first pose, the parts laid flat, and the list of parts."""
    kit, stack, motions = _made(motion, given)
    side_by_side, _ = _placed(parts_of(kit, stack), kit)
    flat = [PlacedPart(part, np.zeros(2), 0.0, 0.0, kit.sizes.thickness) for part in side_by_side]
    return {
        "": "".join(part.solid() for part in _placed_parts(motion, kit, stack, motions)),
        "flat.stl": "".join(part.solid() for part in flat),
        "parts.csv": listed(kit, stack),
    }


def _made(motion: ExportedMotion, given: dict[str, float]) -> tuple[Kit, Stack, Motions]:
    kit = kit_of(motion, given)
    motions = Motions(motion)
    return kit, stacked(motions, kit), motions


def parts_of(kit: Kit, stack: Stack) -> list[CutPart]:
    """Return all parts that are cut."""
    found = [part_of(kit.plates[name], kit) for name in kit.moving]
    found += [part for part, _ in frames(kit, stack)]
    rings = sum(map(len, stack.spacers.values()))
    one = ring(kit)
    found += [CutPart(one.name, one.outline, one.holes, rings)] if rings else []
    return found


def frames(kit: Kit, stack: Stack) -> list[tuple[CutPart, int]]:
    """Return the frame's plates with their layers: behind, and in front where pins reach there."""
    plate = kit.plates[GROUND]
    held = {
        pin: stack.pins[shaft[0]]
        for shaft in stack.shafts
        for pin in shaft
        if GROUND in kit.pins[pin]
    }
    found = []
    for layer, name in ((0, "frame"), (stack.front, "frame in front")):
        pins = {pin for pin, (low, high) in held.items() if layer in (low, high)}
        if layer is not None and pins:
            slots = {
                s: e for s, e in plate.slots.items() if any(p.split(".")[0] == s for p in pins)
            }
            holes = {pin: place for pin, place in plate.holes.items() if pin in pins}
            side = Plate(name, GROUND, plate.corners, holes, slots)
            check_holes(side, kit)
            found.append((part_of(side, kit), layer))
    return found


def listed(kit: Kit, stack: Stack) -> str:
    """Return the list of parts as CSV, sizes in millimetres."""
    sizes = kit.sizes
    t = sizes.thickness * MM
    rows = ["part,count,layer,thickness_mm,note"]
    for name in kit.moving:
        teeth = kit.plates[name].teeth
        rows.append(f"{name},1,{stack.layers[name]},{t:.6g},{teeth.note if teeth else ''}")
    rows += [f"{part.name},1,{layer},{t:.6g}," for part, layer in frames(kit, stack)]
    count = sum(map(len, stack.spacers.values()))
    if count:
        where = "; ".join(f"{name}: {len(rings)}" for name, rings in stack.spacers.items())
        rows.append(f"spacer,{count},,{t:.6g},{where}")
    for name, (low, high) in stack.pins.items():
        length = (high - low + 1) * t
        text = f"diameter {sizes.pin * MM:.6g} mm; length {length:.6g} mm; layers {low} to {high}"
        tight = f"; pressed in: holds {kit.pins[name][0]}" if name in kit.dowels else ""
        rows.append(f"pin {name},1,,,{text}{tight}")
    rows.append(
        f"sizes,,,,width {sizes.width * MM:.6g} mm; clearance {sizes.clearance * MM:.6g} mm; "
        f"air {sizes.air * MM:.6g} mm; kerf {sizes.kerf * MM:.6g} mm"
    )
    for one, mate, mesh in kit.meshes:
        rows.append(
            f"mesh,,,,{one} and {mate} ({mesh.joint}): contact ratio {mesh.ratio:.3f}; "
            f"backlash {mesh.backlash * MM:.4g} mm; teeth {max(mesh.bound, 0.0) * MM:.3g} mm apart "
            "at least"
        )
    for met in stack.meetings:
        gap = f"{met.gap * MM:.4g} mm" if np.isfinite(met.gap) else "no gap proved"
        rows.append(f"apart,,,,{met.one} and {met.other}: {gap} at {met.at}; other layers")
    return "\n".join(rows) + "\n"


# -- the sheet -----------------------------------------------------------------------------


def _turned(part: CutPart) -> CutPart:
    """Return a part with the longest side level and the least corner at the origin."""
    corners = part.outline.corners
    turn = 0.0
    if len(corners) > 1:
        sides = np.roll(corners, -1, axis=0) - corners
        way = sides[int(np.argmax(np.hypot(*sides.T)))]
        turn = -float(np.arctan2(way[1], way[0]))
    level = part.moved(turn, np.zeros(2))
    return level.moved(0.0, level.outline.radius - level.outline.corners.min(axis=0))


def _placed(parts: list[CutPart], kit: Kit) -> tuple[list[CutPart], Floats]:
    """Return the parts side by side in rows, and the size of the sheet [m]."""
    space = SPACE * kit.sizes.width
    each = [_turned(part) for part in parts for _ in range(part.count)]
    spans = [part.outline.corners.max(axis=0) + part.outline.radius for part in each]
    order = sorted(range(len(each)), key=lambda k: -spans[k][1])
    limit = max(max(span[0] for span in spans), np.sqrt(sum(a * b for a, b in spans)) * 1.5)
    x, y, height, wide = space, space, 0.0, 0.0
    found = []
    for k in order:
        if x > space and x + spans[k][0] > limit + space:
            x, y, height = space, y + height + space, 0.0
        found.append(each[k].moved(0.0, np.array([x, y])))
        x, height = x + spans[k][0] + space, max(height, spans[k][1])
        wide = max(wide, x)
    return found, np.array([wide, y + height + space])


def _sheet(motion: ExportedMotion, parts: list[CutPart], kit: Kit) -> str:
    placed, size = _placed(parts, kit)
    w, h = size * MM
    grown = kit.sizes.kerf / 2
    letter = 0.3 * kit.sizes.width * MM
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{w:.3f}mm" height="{h:.3f}mm" '
        f'viewBox="0 0 {w:.3f} {h:.3f}">',
        f"<title>{escape(motion.problem.name)}: parts to cut</title>",
        "<desc>Millimetres at true size. Red lines are cut, blue names are engraved.</desc>",
        '<g fill="none" stroke="#ff0000" stroke-width="0.1">',
    ]
    for part in placed:
        for loop in (part.outline.grown(grown), *(hole.grown(-grown) for hole in part.holes)):
            lines.append(f'<path d="{_path(loop, h)}"/>')
    lines += ["</g>", '<g fill="#0000ff" font-family="sans-serif">']
    for part in placed:
        if part.name == "spacer":
            continue
        (x, y), high = _free(part, letter / MM)
        lines.append(
            f'<text x="{x * MM:.3f}" y="{h - y * MM + high * MM / 3:.3f}" text-anchor="middle" '
            f'font-size="{high * MM:.3f}">{escape(part.name)}</text>'
        )
    return "\n".join([*lines, "</g>", "</svg>"]) + "\n"


def _free(part: CutPart, size: float) -> tuple[Floats, float]:
    """Return the middle and the height of a part's name that meets no hole."""
    outline, count = part.outline, len(part.name)
    core = outline.core()
    low = outline.corners.min(axis=0) - outline.radius
    high = outline.corners.max(axis=0) + outline.radius
    grid: Points = np.stack(np.meshgrid(*np.linspace(low, high, 41).T), -1).reshape(-1, 2)
    best = grid[0]
    for _ in range(SMALLER):
        half = np.array([LETTER * count, 1.0]) * size / 2
        box = half * [(a, b) for a in np.linspace(-1, 1, 2 * count + 1) for b in (-1, 0, 1)]
        places = (grid[:, None] + box).reshape(-1, 1, 2)

        def far(corners: Points, places: Points = places) -> Floats:
            every = np.broadcast_to(corners, (len(places), *corners.shape))
            return polygon_gaps(places, every).reshape(len(grid), -1)

        gaps = [core.radius - far(core.corners).max(axis=1)]
        gaps += [far(hole.corners).min(axis=1) - hole.radius for hole in part.holes]
        room = np.minimum(np.min(gaps, axis=0), size / 4)
        off = np.hypot(*(grid - (low + high) / 2).T)
        best = grid[np.lexsort((off, -room))[0]]
        if room.max() > 0:
            break
        size *= 0.75
    return best, size


def _path(loop: Shape, height: float) -> str:
    """Return a loop as the path of an SVG [mm], whose y leads down."""
    words: list[str] = []
    end = ""
    for k, side in enumerate(loop.sides()):
        points = [f"{p[0] * MM:.4f} {height - p[1] * MM:.4f}" for p in side]
        if points[0] != end:
            words.append(f"{'L' if k else 'M'}{points[0]}")
        if isinstance(side, Bend):
            words.append("C" + " ".join(points[1:]))
            end = points[3]
            continue
        end = points[1]
        if side.radius > 0:
            r = side.radius * MM
            words.append(f"A{r:.4f} {r:.4f} 0 {int(side.turn > np.pi)} 0 {end}")
    return "".join(words) + "Z"


# -- solids --------------------------------------------------------------------------------


def _triangles(part: CutPart) -> tuple[Points, Integers, list[Points]]:
    """Return points, triangles (m, 3) and the loops of a part, the outline first."""
    outlines = (part.outline, *part.holes)
    side = 2 * min(loop.radius for loop in outlines if loop.radius)
    for k in range(FINER):
        polygons = [loop.polygon(side / 2**k) for loop in outlines]
        loops = [loop[::-1] if j else loop for j, loop in enumerate(polygons)]
        faces = triangles(loops, FLAT * side**2)
        if faces is not None:
            return np.vstack(loops), faces, loops
    raise UnavailableError(f"no triangles found for {part.name}", hint="svg-cut")


@dataclass(frozen=True)
class PlacedPart:
    """A part between two heights, turned and moved [m, rad]."""

    part: CutPart
    place: Floats
    turn: float
    low: float
    high: float

    def solid(self) -> str:
        """Return it as a solid of an STL file, millimetres."""
        points, faces, loops = _triangles(self.part)
        flat = (points @ turned(-self.turn) + self.place) * MM
        bottom, top = (np.insert(flat, 2, height * MM, axis=1) for height in (self.low, self.high))
        found = [*top[faces], *bottom[faces[:, ::-1]]]
        begin = 0
        for loop in loops:
            here = begin + np.arange(len(loop))
            after = np.roll(here, -1)
            found += [*np.stack([bottom[here], bottom[after], top[after]], axis=1)]
            found += [*np.stack([bottom[here], top[after], top[here]], axis=1)]
            begin += len(loop)
        lines = [f"solid {self.part.name}"]
        for corners in found:
            normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
            size = float(np.linalg.norm(normal))
            normal = normal / size if size > 0 else normal
            lines.append("facet normal " + " ".join(f"{value:.6g}" for value in normal))
            lines.append("outer loop")
            lines += ["vertex " + " ".join(f"{x:.6f}" for x in corner) for corner in corners]
            lines += ["endloop", "endfacet"]
        return "\n".join([*lines, f"endsolid {self.part.name}"]) + "\n"


def assembly(motion: ExportedMotion, given: dict[str, float]) -> tuple[list[PlacedPart], str]:
    """Return all parts in the motion's first pose, and their list."""
    kit, stack, motions = _made(motion, given)
    return _placed_parts(motion, kit, stack, motions), listed(kit, stack)


def _placed_parts(
    motion: ExportedMotion, kit: Kit, stack: Stack, motions: Motions
) -> list[PlacedPart]:
    t, frame = kit.sizes.thickness, motions.placed(kit, motion.first)
    found = []
    for name in kit.moving:
        low = stack.layers[name] * t
        found.append(PlacedPart(part_of(kit.plates[name], kit), *frame[name], low, low + t))
    for part, layer in frames(kit, stack):
        found.append(PlacedPart(part, np.zeros(2), 0.0, layer * t, (layer + 1) * t))
    one = ring(kit)
    for name, (low, high) in stack.pins.items():
        plate = kit.plates[kit.pins[name][1]]
        place, turn = frame.get(plate.name, (np.zeros(2), 0.0))
        here = place + turned(turn) @ plate.holes[name]
        pin = CutPart(f"pin {name}", Loop(np.zeros((1, 2)), kit.sizes.pin / 2))
        found.append(PlacedPart(pin, here, 0.0, low * t, (high + 1) * t))
        for layer in stack.spacers.get(name, ()):
            spacer = replace(one, name=f"spacer {name}")
            found.append(PlacedPart(spacer, here, 0.0, layer * t, (layer + 1) * t))
    return found
