"""All poses of larger planar groups of pins, guides, slots and bars: paths from generic ones.

A group is read as a linkage of rigid parts (`mechdae.numerics.homotopy.linkage`): parts that slide
on each other have one turn, a slide keeps a pin on a line of a part, a bar is a part with two
pins, a driven coordinate of a point a line of the ground.
"""

from __future__ import annotations

import cmath

import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.kernels.stored.folder import Folder
from mechdae.kernels.stored.folder import place as cache_place
from mechdae.motion.cases.larger_groups.rigid_parts import (
    Coordinates,
    GroupParts,
    GroupPoses,
    LegPoint,
    OtherShape,
    PlacedParts,
    ShapedGroup,
    place,
    shaped,
)
from mechdae.numerics.homotopy.linkage import ComplexDimensions, PinLinkage
from mechdae.numerics.homotopy.linkage_poses import MONODROMY, THEOREM, linkage_poses
from mechdae.numerics.homotopy.stored_instances import Canonical, instance_of
from mechdae.types import Complexes, Floats

BASIS = {
    THEOREM: "homotopy: {} complex poses are certified, as many as there can be",
    MONODROMY: "homotopy: {} complex poses are certified, as many as monodromy finds for generic "
    "dimensions; no theorem tells that number",
}


def linkage_group(scene: Scene, group: Group, p: Floats) -> ShapedGroup | None:
    """Return the group as a linkage, None where it has other joints."""
    return shaped((LinkageGroup,), scene, group, p)


class LinkageGroup(GroupParts):
    """A group of rigid parts joined by pins, guides, slots and bars."""

    def __init__(self, scene: Scene, group: Group, p: Floats) -> None:
        super().__init__(scene, group, p)
        self.bars: list[Joint] = [joint for joint in self.higher if joint.bar]
        self.slots: list[Joint] = [joint for joint in self.higher if not joint.bar]
        self.part: dict[str, int] = {node: k for k, node in enumerate(self.nodes)}
        self.held: list[dict[int, LegPoint | None]] = [{} for _ in self.part]
        """Of each part by pin where it is; None: the origin of the part's frame."""
        self.count: int = 0
        for pin in self.pins:
            self._add_pin(pin)
        self.ends: list[tuple[int, ...]] = [
            tuple(self._pin_at(place(reference)) for reference in (joint.first, joint.second))
            for joint in self.bars
        ]
        self.on_line: list[int] = [self._pin_at(place(joint.second)) for joint in self.slots]
        self.driven_pins: list[int] = [
            self._pin_at(LegPoint(c.part, c.point)) for _, c in self.rails
        ]
        for pins in self.held:
            if not pins:
                pins[self._new_pin()] = None
        self._turn_together()
        self.linkage: PinLinkage = self._linkage()

    def _new_pin(self) -> int:
        self.count += 1
        return self.count - 1

    def _add_pin(self, spots: set[LegPoint]) -> None:
        number = self._new_pin()
        for spot in sorted(spots, key=lambda spot: (spot.body, spot.point)):
            pins = self.held[self.part[self.node_of(spot.body)]]
            if number in pins and self.node_of(spot.body) != GROUND:
                raise OtherShape  # a part is pinned to itself
            pins.setdefault(number, spot)

    def _pin_at(self, spot: LegPoint) -> int:
        """Return the pin at a point, a new one where there is none."""
        pins = self.held[self.part[self.node_of(spot.body)]]
        for number, other in pins.items():
            if other == spot:
                return number
        number = self._new_pin()
        pins[number] = spot
        return number

    def _turn_together(self) -> None:
        """Give parts that slide on each other one turn."""
        leader = list(range(len(self.part)))
        self.along: list[tuple[int, int, Joint]] = []
        for joint in self.guides:
            one, other = (self.part[self.node_of(b)] for b in (joint.first_body, joint.second_body))
            a, b = leader[one], leader[other]
            if a == b:
                raise OtherShape  # a loop of guides has no turn of its own
            leader = [min(a, b) if k in (a, b) else k for k in leader]
            self.along.append((one, other, joint))
        turns = {k: n for n, k in enumerate(sorted(set(leader)))}
        self.turns: tuple[int, ...] = tuple(turns[k] for k in leader)

    def _linkage(self) -> PinLinkage:
        parts = [tuple(pins) for pins in self.held] + [tuple(pair) for pair in self.ends]
        bars = range(max(self.turns) + 1, max(self.turns) + 1 + len(self.bars))
        slides = [(one, next(iter(self.held[other]))) for one, other, _ in self.along]
        for joint, pin in zip(self.slots, self.on_line, strict=True):
            slides.append((self.part[self.node_of(joint.first_body)], pin))
        slides += [(0, pin) for pin in self.driven_pins]
        try:
            linkage = PinLinkage(tuple(parts), (*self.turns, *bars), tuple(slides))
            if not linkage.square:
                raise OtherShape
        except ValueError:
            raise OtherShape from None
        return linkage

    def solve(self, q: Coordinates, u: Floats) -> GroupPoses | None:
        """Return all poses, None where no generic linkage is known."""
        path = cache_place()
        found = instance_of(self.linkage, Folder(path) if path else None)
        if found is None:
            return None
        start, order = found
        at = _Numbers(self, q, u)
        poses = linkage_poses(start, at.numbers(order))
        m = max(self.linkage.turns)
        angles = np.zeros((len(poses.turns), m + 1))
        angles[:, list(order.turns)] = np.concatenate([angles[:, :1], poses.turns], axis=1)
        angles -= angles[:, :1]
        slid = np.zeros_like(poses.slides)
        slid[:, list(order.slides)] = poses.slides
        frames = [at.frames(w, s) for w, s in zip(np.exp(1j * angles), slid, strict=True)]
        return GroupPoses(
            [dict(at.coordinates(frame)) for frame in frames],
            poses.proven,
            BASIS.get(poses.basis, "").format(poses.generic),
            generic=poses.generic,
            singular=poses.singular,
            bounded=start.whole,
        )


class _Numbers(PlacedParts):
    """The numbers of a linkage at one pose of what is known."""

    shape: LinkageGroup

    def __init__(self, shape: LinkageGroup, q: Coordinates, u: Floats) -> None:
        super().__init__(shape, q, u)
        bars = [
            {pair[0]: 0j, pair[1]: complex(shape.number(f"{joint.name}.length"))}
            for joint, pair in zip(shape.bars, shape.ends, strict=True)
        ]
        self.inside = [
            {pin: 0j if spot is None else self.spot(spot) for pin, spot in held.items()}
            for held in shape.held
        ] + bars
        """Of each part by pin its place in the part's frame."""
        self.turned = [1 + 0j] * len(self.inside)
        """The direction of each part in the frame of its turn."""
        for one, other, joint in self._outwards():
            node = shape.nodes[other]
            self.turned[other] = self.turned[one] * cmath.rect(1, self.guided(joint, node))
        self.lines = self._lines()

    def _outwards(self) -> list[tuple[int, int, Joint]]:
        """Return (known part, other part, guide) in an order in which the first one is known."""
        shape, found = self.shape, []
        first = {turn: shape.turns.index(turn) for turn in set(shape.turns)}
        known, rest = set(first.values()), list(shape.along)
        while rest:
            one, other, joint = next(edge for edge in rest if known & {edge[0], edge[1]})
            rest.remove((one, other, joint))
            found.append((one, other, joint) if one in known else (other, one, joint))
            known |= {one, other}
        return found

    def _lines(self) -> list[tuple[complex, complex]]:
        """Return a point and the direction of each slide's line, in the frame of its part."""
        shape, lines = self.shape, []
        for _, other, joint in shape.along:
            start, along = self.spot(place(joint.first)), self.normal(joint) / 1j
            turn = cmath.rect(1, self.guided(joint, shape.nodes[other]))
            pin = next(iter(self.inside[other].values()))
            lines.append((start + turn * (pin - self.spot(place(joint.second))), along))
        for joint in shape.slots:
            lines.append((self.spot(place(joint.first)), self.normal(joint) / 1j))
        for k, c in shape.rails:
            value = float(self.u[k])
            lines.append((1j * value, 1 + 0j) if c.axis else (value + 0j, 1j))
        return lines

    def numbers(self, order: Canonical | None = None) -> ComplexDimensions:
        """Return steps and directions of the linkage, in the canonical numbering if it is given."""
        linkage = self.shape.linkage if order is None else order.linkage
        a, n = [], [0j] * len(linkage.slides)
        for j, u, v, k in linkage.steps:
            if order is not None:
                j, u, v, k = order.parts[j], order.pins[u], order.pins[v], k
            inside, turned = self.inside[j], self.turned[j]
            if k < 0:
                a.append((inside[v] - inside[u]) * turned)
                continue
            start, along = self.lines[k if order is None else order.slides[k]]
            a.append((start - inside[u]) * turned)
            n[k] = along * turned
        return ComplexDimensions.real(np.array(a), np.array(n, complex))

    def frames(self, turns: Complexes, slides: Floats) -> dict[str, tuple[complex, complex]]:
        """Return origin and direction of the parts' frames."""
        linkage, numbers = self.shape.linkage, self.numbers()
        of_step = linkage.step_slides
        a = numbers.a + (
            np.where(of_step >= 0, (slides * numbers.n)[of_step], 0) if len(slides) else 0
        )
        steps = a * turns[linkage.step_turns]
        places = {
            pin: sum((sign * steps[e] for e, sign in way.items()), 0j)
            for pin, way in linkage.tree.items()
        }
        pin, inside = next(iter(self.inside[0].items()))
        shift = inside - places[pin]
        frames = {}
        for k, node in enumerate(self.shape.nodes):
            pin, inside = next(iter(self.inside[k].items()))
            w = complex(turns[linkage.turns[k]] * self.turned[k])
            frames[node] = places[pin] + shift - w * inside, w
        return frames
