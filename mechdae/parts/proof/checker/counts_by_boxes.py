"""Modes in space that no theorem counts: besides them there is nothing in any box."""

from __future__ import annotations

from typing import Any

from flint import arb

from .arithmetic import LAST, Json, exact, exacts, field, need
from .boxes import MET, Boxes
from .counts import families_of
from .hinges import HingeBoxes
from .legs import LegBoxes
from .space import SpatialMechanism
from .tubes import solution

PROOFS: dict[str, type[Boxes]] = {"turns": HingeBoxes, "places": LegBoxes}
"""By what a certificate says that its proof is."""
PLACED = 1e-25
"""Radius of the balls in which poses are compared, of each coordinate's size."""


def mode_in_balls(m: SpatialMechanism, mode: Json, s: arb, at: str) -> list[arb]:
    """Return balls of some width that hold one solution of the equations that are kept."""
    solution_box = m.agrees(solution(m, m.claimed(mode, s, at)).box(), mode, at)
    pairs = zip(solution_box[:LAST], m.scale[:LAST], strict=True)
    return [*(v + arb(0, PLACED * scale) for v, scale in pairs), s]


def boxes_without_others(
    m: SpatialMechanism, proof: type[Boxes], groups: list[Any], modes: list[Any], known: set[str]
) -> int:
    """Return in how many boxes it is shown that groups have no other poses than those of modes."""
    group = groups[0]
    joints, numbered = m.joints_of(group, known), list[tuple[list[arb], list[arb]]]()
    for z in modes:
        frames = m.placed(z)
        numbers = [v for body in group for row in (frames[body][0], *frames[body][1]) for v in row]
        numbered.append((z, numbers))
    families = families_of(numbered, lambda one, other: _near(one[1], other[1]))
    driven = any(name.split(".")[0] in joints for name in m.drivers)
    kinds, count = [joint["kind"] for joint in joints.values()], 0
    if len(kinds) > 1 or not (driven or kinds == ["weld"]):
        boxes = proof(m, group, [*joints.values()], known, modes[0])
        count = boxes.look(boxes.first(), [boxes.mode(family[0][0]) for family in families])
    else:
        need(len(families) == len(group) == 1, "groups", f"{group} have one pose")
    if not groups[1:]:
        need(len(families) == len(modes), "modes", "one of them stands there twice")
        return count
    after = known | {*group}
    return count + sum(
        boxes_without_others(m, proof, groups[1:], [z for z, _ in family], after)
        for family in families
    )


def _near(one: list[arb], other: list[arb]) -> bool:
    return all(abs(v - w) < MET for v, w in zip(one, other, strict=True))


def check_modes_by_boxes(m: SpatialMechanism, data: Json) -> str:
    """Check all poses at one value of the driver, and that there are no others."""
    s, groups = exact(field(data, "at", str, "modes"), "at"), field(data, "groups", list, "modes")
    proof, modes = PROOFS[field(data, "proof", str, "certificate")], list[list[arb]]()
    for k, mode in enumerate(field(data, "modes", list, "certificate")):
        at = f"modes/{k}"
        exacts(field(mode, "signs", list, at), len(groups), f"{at}/signs")
        modes.append(mode_in_balls(m, mode, s, at))
        m.compare(modes[LAST], mode, at)
    every = modes and sorted(sum(groups, ["ground"])) == sorted(m.points)
    need(every, "groups", "not the bodies of the mechanism, or no mode at all")
    count = boxes_without_others(m, proof, groups, modes, {"ground"})
    boxes = f"nothing else in {count} boxes; redundant equations to {m.off:.1g}"
    return f"{len(modes)} modes, and no others: {boxes}"
