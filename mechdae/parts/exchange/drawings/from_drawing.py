"""A DXF sketch as a problem: lines are links, circles at their ends are pins.

Lines that end on each other without a circle there are one link, as the sides of a polyline are,
and so are lines that have two pins in common. A pin inside of a line belongs to it too. Fixed are
pins on a layer GROUND (FIXED, BASE, SUPPORT) and pins with a second circle around them; a line on
such a layer is part of the ground. A line on a layer GUIDES holds the pins on it: they slide along
it.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from mechdae.describe import (
    GROUND,
    Body,
    Driver,
    Ground,
    Joint,
    Mechanism,
    Problem,
    Sweep,
    Table,
    Task,
)
from mechdae.describe.joints.pairs import PinInSlot, Prismatic, Revolute
from mechdae.describe.tasks.kinds import Modes
from mechdae.errors import InputError
from mechdae.parts.exchange.drawings.dxf_read import DrawnSketch, Spot, distance, read_drawing

FIXED = ("GROUND", "FIXED", "BASE", "SUPPORT")
GUIDES = ("GUIDE", "GUIDES", "SLIDE", "SLIDES")
LINKS = "LINKS"
"""Where a drawing has such a layer, its links are there and nowhere else."""
NOT_LINKS = ("PATHS", "NAMES", "JOINTS", "DIMENSIONS", "TEXT", "CONSTRUCTION")
NEAR = 1e-6
"""Share of the drawing's size within which places are one."""
ON = 1e-4
"""Share of its size within which a pin is on a line."""
SNAP = 1.05
"""Radii within which the end of a line is meant for a pin."""
SLOT = 2.0
"""Radii of a pin within which the sides of its slot are."""
DIGITS = 12
POSES = 361


@dataclass
class _Pin:
    """A pin: where it is, the largest circle of it, whether it is fixed."""

    center: Spot
    radius: float
    fixed: bool = False
    name: str = ""


@dataclass
class _DrawnLink:
    """A link: its corners, its lines and the pins on it."""

    corners: list[Spot]
    fixed: bool = False
    lines: list[tuple[Spot, Spot]] = field(default_factory=list)
    pins: list[_Pin] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.lines = list(itertools.pairwise(self.corners))

    def join(self, other: _DrawnLink) -> None:
        """Make another link part of this one."""
        self.corners += other.corners
        self.lines += other.lines
        self.pins += [pin for pin in other.pins if pin not in self.pins]
        self.fixed |= other.fixed


def problem_of_drawing(
    path: str | Path, unit: str | None = None, ground: tuple[Spot, ...] = ()
) -> tuple[Problem, list[str]]:
    """Return the problem in a DXF sketch, and remarks on what was made of it.

    `unit`: unit of the drawing, in place of its own. `ground`: places of fixed pins, in units of
    the drawing.
    """
    drawing = read_drawing(path, unit)
    places = tuple((x * drawing.unit, y * drawing.unit) for x, y in ground)
    try:
        sketch = _Sketch(drawing, str(path), places)
        mechanism = sketch.mechanism()
    except InputError as error:
        lines = [line for line in drawing.lines if line.layer == "JOINTS"]
        drawing.skipped.update("line on layer JOINTS" for _ in lines)
        error.hint = "; ".join([error.hint, *_unread(drawing)])
        raise
    tasks, remarks = _tasks(mechanism)
    drawing.skipped.update(sketch.unread)
    remarks += _unread(drawing)
    name = Path(path).stem
    title = f"From the drawing {Path(path).name}"
    return Problem(mechanism, Table(tasks), name=name, title=title), remarks


def _unread(drawing: DrawnSketch) -> list[str]:
    """Return what of a drawing is no part of the mechanism read."""
    skipped = ", ".join(f"{count} {name}" for name, count in sorted(drawing.skipped.items()))
    return [*([f"not read: {skipped}"] if skipped else []), *drawing.undrawn]


class _Sketch:
    def __init__(self, drawing: DrawnSketch, path: str, ground: tuple[Spot, ...]) -> None:
        self.path = path
        self.unread: Counter[str] = Counter()
        self.grounded = bool(drawing.layers & {*FIXED})
        layers = {line.layer for line in drawing.lines}
        ignored = (*NOT_LINKS, *GUIDES)
        chosen = [
            line
            for line in drawing.lines
            if (line.layer in (LINKS, *FIXED) if LINKS in layers else line.layer not in ignored)
        ]
        if not chosen:
            raise InputError(
                "no lines that could be links", where=path, hint="LINE or POLYLINE entities"
            )
        places = [corner for line in chosen for corner in line.corners]
        self.size = max(max(p[k] for p in places) - min(p[k] for p in places) for k in (0, 1))
        self.pins = self._pins(drawing, ground)
        self.guides = [line.corners for line in drawing.lines if line.layer in GUIDES]
        self.links = self._links(
            [
                _DrawnLink([self._snapped(c) for c in line.corners], line.layer in FIXED)
                for line in chosen
            ]
        )
        for link in self.links:
            if link.fixed and not link.pins:
                self.unread["line of the ground without a pin"] += 1
        blocks = [line for line in drawing.lines if line.layer == "JOINTS"]
        for line in blocks:  # a block on a guide that is read is drawn for the eye only
            middle = _middle(line.corners)
            pin = any(math.dist(pin.center, middle) <= ON * self.size for pin in self.pins)
            if line.corners[0] != line.corners[-1] or not (pin and self._guided(middle)):
                self.unread["line on layer JOINTS"] += 1

    def _pins(self, drawing: DrawnSketch, ground: tuple[Spot, ...]) -> list[_Pin]:
        pins: list[_Pin] = []
        for circle in drawing.circles:
            if circle.layer in ("PATHS", "NAMES", "CONSTRUCTION"):
                continue
            fixed = circle.layer in FIXED
            same = [pin for pin in pins if math.dist(pin.center, circle.center) <= NEAR * self.size]
            if same:  # a second circle around it, where no layer says what is fixed
                other = circle.radius != same[0].radius
                outer = fixed if circle.radius > same[0].radius else same[0].fixed
                if other and self.grounded and not outer:
                    self.unread["second circle around a pin"] += 1
                same[0].fixed = fixed or same[0].fixed or (other and not self.grounded)
                same[0].radius = min(same[0].radius, circle.radius) or circle.radius
            else:
                pins.append(_Pin(circle.center, circle.radius, fixed))
        if not pins:
            raise InputError(
                "no circles that could be pins", where=self.path, hint="a circle at each joint"
            )
        for place in ground:
            near = min(pins, key=lambda pin: math.dist(pin.center, place))
            if math.dist(near.center, place) > max(near.radius, 0.02 * self.size):
                raise InputError(f"no pin at {place[0]:g}, {place[1]:g} m", where="--ground")
            near.fixed = True
        return pins

    def _snapped(self, corner: Spot) -> Spot:
        """Return the pin that the end of a line is meant for, else the place itself."""
        near = min(self.pins, key=lambda pin: math.dist(pin.center, corner))
        reach = max(SNAP * near.radius, NEAR * self.size)
        return near.center if math.dist(near.center, corner) <= reach else corner

    def _links(self, links: list[_DrawnLink]) -> list[_DrawnLink]:
        """Return the links: those that meet where no pin is are one."""
        joined: list[_DrawnLink] = []
        for link in links:
            for other in [one for one in joined if self._meet(one, link)]:
                link.join(other)
                joined.remove(other)
            joined.append(link)
        found: list[_DrawnLink] = []
        for link in joined:
            link.pins = [pin for pin in self.pins if self._holds(link, pin)]
            for other in found:  # two pins in common hold two links together
                if sum(pin in other.pins for pin in link.pins) > 1:
                    other.join(link)
                    break
            else:
                found.append(link)
        return found

    def _meet(self, one: _DrawnLink, other: _DrawnLink) -> bool:
        pins = [pin.center for pin in self.pins]
        return (one.fixed and other.fixed) or any(
            math.dist(a, b) <= NEAR * self.size and a not in pins
            for a in one.corners
            for b in other.corners
        )

    def _holds(self, link: _DrawnLink, pin: _Pin) -> bool:
        if pin.center in link.corners:
            return True
        return any(distance(pin.center, *edge) <= ON * self.size for edge in link.lines)

    # -- the mechanism ---------------------------------------------------------------------

    def mechanism(self) -> Mechanism:
        """Return bodies, joints and sketch."""
        for pin, letter in zip(self.pins, _letters(), strict=False):
            pin.name = letter
        moving = [link for link in self.links if not link.fixed]
        for link in self.links:
            for pin in link.pins if link.fixed else ():
                pin.fixed = True
        if not any(pin.fixed or self._held(pin) for pin in self.pins):
            pins = ", ".join(f"({p.center[0]:g}, {p.center[1]:g})" for p in self.pins)
            raise InputError(
                f"no pin is fixed; there are pins at {pins} m",
                where=self.path,
                hint="put its circle on a layer GROUND, draw a second circle around it, "
                "or give --ground X,Y",
            )
        names = {id(link): f"link{k}" for k, link in enumerate(moving, 1)}
        bodies = [self._body(link, names[id(link)]) for link in moving]
        ground = {pin.name: _rounded(pin.center) for pin in self.pins if pin.fixed}
        joints, blocks = self._joints(moving, names, ground)
        self._check(moving, joints, names)
        sketch = {names[id(link)]: _angle(link) for link in moving}
        return Mechanism(
            Ground(points=Table(ground)),
            Table({body.name: body for body in (*bodies, *blocks)}),
            Table({joint.name: joint for joint in joints}),
            sketch=Table(sketch),
        )

    def _body(self, link: _DrawnLink, name: str) -> Body:
        """Return a link with its first two corners on the axis of its frame."""
        origin, angle = link.corners[0], _angle(link)
        points = {pin.name: _local(pin.center, origin, angle) for pin in link.pins}
        known = [pin.center for pin in link.pins]
        free = [c for c in dict.fromkeys(link.corners) if c not in known]
        points |= {f"P{k}": _local(corner, origin, angle) for k, corner in enumerate(free, 1)}
        return Body(name, points=Table(points))

    def _joints(
        self, moving: list[_DrawnLink], names: dict[int, str], ground: dict[str, Spot]
    ) -> tuple[list[Joint], list[Body]]:
        joints: list[Joint] = []
        blocks: list[Body] = []
        used: list[tuple[Spot, ...]] = []
        for pin in self.pins:
            on = [names[id(link)] for link in moving if pin in link.pins]
            guide = next((g for g in self.guides if self._on(pin, g)), None)
            slot = self._slot(pin) if guide is None and not pin.fixed and on else None
            used += [guide] if guide is not None else [*(slot or ())]
            if slot is not None:
                fixed = f"{pin.name}0"
                ground[fixed] = _rounded(pin.center)
                (x, y), (u, v) = slot[0][0], slot[0][-1]
                turn = round(math.atan2(v - y, u - x), DIGITS)
                name = f"slot_{pin.name}"
                joints.append(
                    PinInSlot(name, f"{GROUND}.{fixed}", f"{on[0]}.{pin.name}", axis=turn)
                )
            if guide is not None and not pin.fixed and on:
                block = f"block{len(blocks) + 1}"
                blocks.append(Body(block, points=Table({pin.name: (0.0, 0.0)})))
                fixed = f"{pin.name}0"
                ground[fixed] = _rounded(pin.center)
                turn = math.atan2(guide[-1][1] - guide[0][1], guide[-1][0] - guide[0][0])
                joints.append(
                    Prismatic(
                        f"guide{len(blocks)}",
                        f"{GROUND}.{fixed}",
                        f"{block}.{pin.name}",
                        axis=round(turn, DIGITS),
                    )
                )
                on = [block, *on]
            elif pin.fixed:
                on = [GROUND, *on]
            pairs = [(on[0], other) for other in on[1:]]
            for k, (one, other) in enumerate(pairs, 1):
                name = pin.name if len(pairs) == 1 else f"{pin.name}_{k}"
                joints.append(Revolute(name, f"{one}.{pin.name}", f"{other}.{pin.name}"))
        lost = sum(guide not in used for guide in self.guides)
        if lost:
            self.unread["guide without a pin"] += lost
        return joints, blocks

    def _held(self, pin: _Pin) -> bool:
        """Whether a guide of the ground holds a pin."""
        return any(self._on(pin, guide) for guide in self.guides) or self._slot(pin) is not None

    def _guided(self, place: Spot) -> bool:
        return any(
            distance(place, *edge) <= ON * self.size
            for guide in self.guides
            for edge in itertools.pairwise(guide)
        )

    def _slot(self, pin: _Pin) -> tuple[tuple[Spot, ...], tuple[Spot, ...]] | None:
        """Return the two parallel guides that a pin lies in the middle of."""
        near = [
            (guide, far)
            for guide in self.guides
            if len(guide) == 2 and (far := distance(pin.center, *guide)) <= SLOT * pin.radius
        ]
        for (one, far), (other, also) in itertools.combinations(near, 2):
            ways = [(b[0] - a[0], b[1] - a[1]) for a, b in (one, other)]
            cross = ways[0][0] * ways[1][1] - ways[0][1] * ways[1][0]
            between = math.dist(_middle(one), _middle(other))
            level = abs(cross) <= ON * math.hypot(*ways[0]) * math.hypot(*ways[1])
            if level and abs(far - also) <= ON * self.size and abs(between - 2 * far) <= far:
                return one, other
        return None

    def _on(self, pin: _Pin, guide: tuple[Spot, ...]) -> bool:
        return any(
            distance(pin.center, *edge) <= max(ON * self.size, pin.radius)
            for edge in itertools.pairwise(guide)
        )

    def _check(self, moving: list[_DrawnLink], joints: list[Joint], names: dict[int, str]) -> None:
        """Raise for links that hang on nothing."""
        if not moving:
            raise InputError("all lines are part of the ground", where=self.path)
        reached = {GROUND}
        for _ in joints:
            for joint in joints:
                if reached & set(joint.bodies):
                    reached |= set(joint.bodies)
        for link in moving:
            name = names[id(link)]
            if name not in reached:
                (x, y), (u, v) = link.corners[0], link.corners[-1]
                raise InputError(
                    f"the line from ({x:g}, {y:g}) to ({u:g}, {v:g}) m hangs on no pin of the "
                    "mechanism",
                    where=self.path,
                    hint="a circle where it is joined, or a layer CONSTRUCTION for what is no link",
                )


def _tasks(mechanism: Mechanism) -> tuple[dict[str, Task], list[str]]:
    """Return a sweep of a link that turns in the ground, and its assembly modes."""
    held = sum(1 if joint.slot else 2 for joint in mechanism.joints.values())
    freedoms = 3 * len(mechanism.bodies) - held
    cranks = [
        joint.second_body
        for joint in mechanism.joints.values()
        if joint.first_body == GROUND and joint.turns
    ]
    if freedoms != 1 or not cranks:
        return {}, [f"mobility by count {freedoms}: tasks with drivers are left to be written"]
    name = f"{cranks[0]}.angle"
    at = mechanism.sketch[cranks[0]]
    tasks: dict[str, Task] = {
        "turn": Sweep(driver=Driver(name, range="assembled"), poses=POSES),
        "modes": Modes(driver=Driver(name, at=(at,))),
    }
    return tasks, [f"driver: {name}"]


def _letters() -> itertools.chain[str]:
    letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
    more = (f"{letter}{k}" for k in itertools.count(1) for letter in letters)
    return itertools.chain(letters, more)


def _angle(link: _DrawnLink) -> float:
    (x, y), (u, v) = link.corners[0], link.corners[1]
    return round(math.atan2(v - y, u - x), DIGITS)


def _local(place: Spot, origin: Spot, angle: float) -> Spot:
    x, y = place[0] - origin[0], place[1] - origin[1]
    c, s = math.cos(angle), math.sin(angle)
    return _rounded((c * x + s * y, -s * x + c * y))


def _rounded(place: Spot) -> Spot:
    return round(place[0], DIGITS) + 0.0, round(place[1], DIGITS) + 0.0


def _middle(corners: tuple[Spot, ...]) -> Spot:
    """Return the mean of the corners, a closed line's last one counted once."""
    ring = corners[:-1] if len(corners) > 2 and corners[0] == corners[-1] else corners
    return sum(x for x, _ in ring) / len(ring), sum(y for _, y in ring) / len(ring)
