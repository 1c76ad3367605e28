"""Modes: all poses at one value of the driver, as many complex ones as theorems allow."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from flint import acb, arb, arb_mat

from .arithmetic import LAST, ZERO, FalseClaim, Json, K, exact, exacts, field, need
from .boxes import MET, Boxes, HingeBoxes, LegBoxes
from .mechanism import ClaimedMechanism
from .space import SpatialMechanism
from .tubes import solution

COMPLEX_OFF = 1e-9
"""How far complex poses may be off their places, of 1 + the size."""


class Theorems(NamedTuple):
    """What is known of groups of bodies in the plane, or in space."""

    most: Callable[[Any, list[str], set[str]], tuple[int, str]]
    """How many complex poses a group has at most, and by which theorem; 0 and why not."""
    alike: Callable[[Any, list[list[str]], list[arb], list[arb]], bool]
    """Whether two poses in balls may be one."""
    aside: Callable[[Any, list[list[str]], list[str]], str]
    """What poses are counted without."""


class Count:
    """How many complex poses groups have together, and why."""

    def __init__(self, m: ClaimedMechanism, groups: list[list[str]], theorems: Theorems) -> None:
        self.most, self.known = 1, {"ground"}
        self.of_groups: list[tuple[int, str]] = list[tuple[int, str]]()
        for group in groups:
            self.of_groups.append(theorems.most(m, group, self.known))
            self.most, self.known = self.most * self.of_groups[LAST][0], self.known | {*group}
        self.theorems: list[str] = [theorem for _, theorem in self.of_groups]
        self.complete: bool = self.known == {"ground", *m.points}

    def __str__(self) -> str:
        """Return the counts of groups, or why one has none."""
        if not self.most:
            return next(why for count, why in self.of_groups if not count)
        return " times ".join(f"{count} by {why}" for count, why in self.of_groups if why)


def families_of(poses: list[K], alike: Callable[[K, K], bool]) -> list[list[K]]:
    """Return poses by those that are alike to the first of a family."""
    families = list[list[K]]()
    for z in poses:
        same = next((family for family in families if alike(family[0], z)), None)
        if same is None:
            families.append([z])
        else:
            same.append(z)
    return families


def group_columns(m: ClaimedMechanism, groups: list[list[str]]) -> Iterator[list[int]]:
    """Yield the coordinates that are those of each group: of its bodies, and of its joints."""
    known, seen = {"ground"}, set[int]()
    for group in groups:
        known |= {*group}
        columns = [k for k in range(m.n) if k not in seen and m.bodies_of(k) <= known]
        seen |= {*columns}
        yield columns


def determinant_signs(m: ClaimedMechanism, groups: list[list[str]], z: list[arb]) -> Iterator[int]:
    """Yield the sign of each group's determinant at a pose in balls."""
    rows, seen = m.slopes(z)[1], {m.n}
    for columns in group_columns(m, groups):
        seen |= {*columns}
        of_group = [row for row in rows if row.keys() <= seen]
        rows = [row for row in rows if not row.keys() <= seen]
        det = arb_mat([[row.get(k, ZERO) for k in columns] for row in of_group]).det()
        yield bool(det > 0) - bool(det < 0)


def complex_poses_of(
    m: ClaimedMechanism, data: Json, s: arb, groups: list[list[str]], theorems: Theorems
) -> Iterator[tuple[str, Any]]:
    """Yield the place in the file and the tube of each complex pose; no two may be alike."""
    found = list[list[arb]]()
    for k, numbers in enumerate(field(data, "complex", list, "certificate")):
        at = f"complex/{k}"
        z = [acb(*exacts(pair, 2, at)) for pair in numbers] + [acb(s)]
        pose = solution(m, z) if len(z) == m.n + 1 else None
        box = pose.box() if pose else []
        new = box and not any(theorems.alike(m, groups, box, earlier) for earlier in found)
        near = new and all(
            (a - b).abs_upper() < COMPLEX_OFF * (1 + m.size) for a, b in zip(z, box, strict=True)
        )
        need(near, at, f"no pose, one that stands there twice, or {COMPLEX_OFF} off")
        found.append(box)
        yield at, pose


def real_poses(
    m: ClaimedMechanism, data: Json, s: arb, groups: list[list[str]], theorems: Theorems
) -> tuple[list[list[arb]], int]:
    """Return those of the complex poses that are real, in balls, and how many all are."""
    real, count = list[list[arb]](), 0
    for at, pose in complex_poses_of(m, data, s, groups, theorems):
        count, box = count + 1, pose.box()
        need(m.oriented(box), at, m.wrong_sense)
        if all(x.imag == 0 for x in pose.z):  # so is its mirror image, in the same balls: one
            real.append(box)
        elif all(x.imag.contains(0) for x in box):
            raise FalseClaim(at, "neither real nor not")
    return real, count


def check_modes(m: ClaimedMechanism, data: Json, theorems: Theorems) -> str:
    """Check all poses at one value of the driver, and that there are no others."""
    need(not m.spins, "mechanism/spins", "modes are those of one spin each")
    s, groups = exact(field(data, "at", str, "modes"), "at"), field(data, "groups", list, "modes")
    counted, signs, seen = Count(m, groups, theorems), dict[int, arb](), list[list[arb]]()
    real, found = real_poses(m, data, s, groups, theorems)
    need(counted.complete, "groups", "not the bodies of the mechanism")
    every = found == counted.most or not counted.most
    need(every, "complex", f"{found} poses, and not all {counted.most}")
    for k, mode in enumerate(field(data, "modes", list, "certificate")):
        at = f"modes/{k}"
        z = m.agrees(solution(m, m.claimed(mode, s, at)).box(), mode, at)
        m.compare(z, mode, at)
        z_complex = [acb(x) for x in z]
        left = [pose for pose in real if not theorems.alike(m, groups, pose, z_complex)]
        new = not any(theorems.alike(m, groups, z, earlier) for earlier in seen)
        matched = len(left) == len(real) - 1 or not counted.most
        need(new and matched, at, "stands there twice, or is none of the poses found")
        real, seen = left, [*seen, z]
        labels = exacts(field(mode, "signs", list, at), len(groups), f"{at}/signs")
        if m.left_out:
            continue  # signs of labels are not claimed
        for g, sign in enumerate(determinant_signs(m, groups, z)):
            same = sign != 0 and labels[g] * sign == signs.setdefault(g, labels[g] * sign)
            need(same, f"{at}/signs/{g}", "does not fit those of the other modes")
    need(not real, "modes", f"{len(real)} poses are left out")
    if not counted.most:
        return f"{len(seen)} modes exist; that there are no others is not claimed: {counted}"
    reasons = str(counted) or "1 by linear equations"
    aside = theorems.aside(m, groups, counted.theorems)
    return f"{len(seen)} modes, and no others: of {counted.most} complex poses, {reasons}{aside}"


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
