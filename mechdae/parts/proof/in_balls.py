"""Poses as balls have them, to the last bit; all complex ones at one value of the driver.

The balls of complex ones begin with coordinates that paths of whole groups led to.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from flint import acb

from mechdae.errors import UnavailableError
from mechdae.motion.cases.larger_groups.rigid_parts import GroupPoses
from mechdae.parts.proof.checker import mechanism_of
from mechdae.parts.proof.checker.arithmetic import ONE, ZERO, Dual, FalseClaim, exact
from mechdae.parts.proof.checker.counts import Count
from mechdae.parts.proof.checker.space import rotation
from mechdae.parts.proof.checker.theorems_in_plane import IN_PLANE
from mechdae.parts.proof.checker.theorems_in_space import IN_SPACE
from mechdae.parts.proof.checker.tubes import follow, solution, turning
from mechdae.parts.proof.mechanism import as_text
from mechdae.types import Floats, Json

if TYPE_CHECKING:
    from mechdae.parts.proof.checker.counts import Theorems
    from mechdae.parts.proof.checker.mechanism import ClaimedMechanism
    from mechdae.parts.proof.checker.space import SpatialMechanism


def poses_of_group(m: SpatialMechanism, z: list[Any], group: GroupPoses) -> list[list[Any]]:
    """Return poses that differ from a pose in the bodies of one group, solved by paths.

    `z`: one pose, real or complex; last the parameter. `group`: what its paths led to.
    """
    if group.axes is not None:
        return hinge_row_poses(m, z, group.row, group.axes)
    if group.placed is None:
        return []
    reference, places, turns = group.placed
    body, _, point = reference.partition(".")
    found, at = [], m.at[body, "x"]
    for place, e in zip(places, turns, strict=True):
        pose, rows = list(z), rotation(*(acb(complex(v)) for v in e))
        R = np.array([[complex(v) for v in row] for row in rows])
        r = place - R @ _numbers(m.points[body][point])
        pose[at : at + 7] = [acb(complex(value)) for value in (*r, *e)]
        found.append(pose)
    return found


def hinge_row_poses(
    m: SpatialMechanism, z: list[Any], row: Sequence[tuple[str, bool]], axes: Any
) -> list[list[Any]]:
    """Return poses that differ from a pose in the bodies of a row of hinges.

    `z`: one pose, real or complex; last the parameter. `row`: joints from one known body to the
    other, and whether the first body comes first there. `axes` (n, k, 3): directions of the joints'
    axes in the poses.
    """
    joints = [m.joints[name] for name, _ in row]
    base, start = m.placed([v.real for v in z]), joints[0]["ends"][0 if row[0][1] else 1]
    first = np.array([complex(v) for v in m.place(start, base)])
    found = []
    for directions in axes:
        pose, here = list(z), first
        for k in range(len(row) - 1):
            near, far = (1 if row[k][1] else 0), (0 if row[k + 1][1] else 1)
            body, point = joints[k]["ends"][near]
            p, q = (_numbers(m.points[body][w]) for w in (point, joints[k + 1]["ends"][far][1]))
            inner = [_numbers(joints[j]["sides"][s][2]) for j, s in ((k, near), (k + 1, far))]
            R = _frame(*directions[k : k + 2]) @ np.linalg.inv(_frame(*inner))
            at, r = m.at[body, "x"], here - R @ p
            pose[at : at + 7] = [acb(complex(v)) for v in (*r, *_quaternion(R))]
            here = r + R @ q
        found.append(pose)
    return found


def _numbers(values: Any) -> Any:
    return np.array([float(v) for v in values])


def _frame(one: Any, other: Any) -> Any:
    return np.stack([one, other, np.cross(one, other)], axis=1)


def _quaternion(R: Any) -> Any:
    """Return the quaternion (4,) of a complex rotation, from its largest entry."""
    R = R.astype(complex)
    trace = np.trace(R)
    squares = np.array([1 + trace, *(1 + 2 * R[i, i] - trace for i in range(3))]) / 4
    k = int(np.argmax(np.abs(squares)))
    turn = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    products = np.empty((4, 4), complex)
    products[0, 1:] = products[1:, 0] = np.array(turn) / 4
    products[1:, 1:] = (R + R.T) / 4
    np.fill_diagonal(products, squares)
    return products[k] / np.sqrt(squares[k])


LAST_KEPT = 1e-3
"""Weight of the equations of crosses and screws: theorems count poses of those that keep others."""
STARTS, MOST_STARTS = 200, 1000
"""Starts for each pose that is sought, and in all."""


def left_out(mechanism: Json, places: Sequence[tuple[dict[str, Any], str]]) -> list[str]:
    """Return as many equations as there are redundant ones, those that others tell.

    They are equations of joints, one after the other those that carry most of the self-stresses,
    the combinations of equations in which nothing changes, at each of the `places` (bodies,
    driver's value): what is kept is regular there.
    """
    m: Any = mechanism_of(mechanism, square=False)
    slopes = [_slopes(m, *place) for place in places]
    stresses = [np.linalg.svd(J)[0][:, m.n :] for J in slopes]
    choice = [k for k, kind in enumerate(m.kinds) if kind != "norm"]
    chosen = list[int]()
    for _ in range(len(slopes[0]) - m.n):
        shares = {k: min(_least(S[[*chosen, k]]) for S in stresses) for k in choice}
        chosen.append(max(shares, key=shares.__getitem__))
        choice.remove(chosen[-1])
    return [str(k) for k in sorted(chosen)]


def _least(rows: Floats) -> float:
    return float(np.linalg.svd(rows, compute_uv=False)[-1])


def _slopes(m: SpatialMechanism, bodies: dict[str, list[str]], at: str) -> Any:
    """Return the derivatives of all equations at a pose, in rows of length 1 or `LAST_KEPT`."""
    z = m.claimed({"bodies": bodies}, exact(at, "at"), "at")
    rows = m.equations([Dual(x, {k: ONE}) for k, x in enumerate(z)])[0]
    J = np.array([[float(row.d.get(k, ZERO)) for k in range(m.n)] for row in rows])
    J *= np.array(m.scale[: m.n])
    J /= np.linalg.norm(J, axis=1, keepdims=True)
    weights = [LAST_KEPT if kind in ("universal", "screw") else 1.0 for kind in m.kinds]
    return J * np.array([*weights, *[1.0] * (len(J) - len(weights))])[:, None]


def names_of(mechanism: Json) -> list[tuple[str, str]]:
    """Return the coordinates that the checker has: owner and word of each."""
    return list(mechanism_of(mechanism, square=False).names)


def refined_path(mechanism: dict[str, Any], path: dict[str, Any]) -> Json:
    """Return a path with its poses to the last bit; those that balls do not prove as they were."""
    m, places = mechanism_of(mechanism), [path, *path["steps"]]
    corners = m.dimension == 3 and any(isinstance(law, list) for law in m.drivers.values())
    z: list[Any] | None = None
    for place in places:
        to = exact(place.get("to", path["at"]), "at")
        try:
            if z is None or not corners:
                z = solution(m, m.claimed(place, to, "at")).box()
            else:  # whole legs: signs of quaternions are those that the way leads to
                *_, (_, z) = follow(m, z, m.n, to)
            place["bodies"] = _bodies(m, z)
        except ArithmeticError:
            pass  # the check says what is wrong
    for word, sense, near in (("low", -1, path), ("high", 1, places[-1])):
        if word in path:
            at = near["at"] if near is path else near["to"]
            try:
                z = solution(m, m.claimed(near, exact(at, word), word)).box()
                claim = m.claimed(path[word], exact(path[word]["at"], word), word)
                path[word]["bodies"] = _bodies(m, turning(m, z, claim, sense, word))
            except (ArithmeticError, FalseClaim):
                pass  # the check says what is wrong
    return path


def refined_mode(mechanism: Json, mode: Json, at: str) -> Json:
    """Return a mode with its pose to the last bit, as it was where balls do not prove one."""
    m = mechanism_of(mechanism)
    try:
        z = solution(m, m.claimed(mode, exact(at, "at"), "at")).z
    except ArithmeticError:
        return mode
    return mode | {"bodies": _bodies(m, z)}


def _bodies(m: ClaimedMechanism, z: list[Any]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for (owner, _), v in zip(m.names, z, strict=False):
        found.setdefault(owner, []).append(as_text(v.mid()))
    return found


def complex_poses(
    content: dict[str, Any],
    real: list[Json],
    solved: Sequence[GroupPoses] = (),
) -> list[list[list[str]]]:
    """Return places to look at for all complex poses, the real ones first: (re, im) of each number.

    Poses of groups that were `solved` by paths are tried before random ones.
    """
    search = PoseSearch(content)
    starts = [[acb(v) for v in search.m.claimed(mode, search.u, "modes")] for mode in real]
    for group in solved if search.m.dimension == 3 and starts else ():
        starts += poses_of_group(search.m, starts[0], group)
    lost = any(group.singular for group in solved)  # random starts do not lead there either
    found = search.found(starts, 0 if lost else STARTS)
    if len(found) < search.count:
        raise UnavailableError(
            f"{len(found)} complex poses of {search.count} are found: others are singular or at "
            "infinity, so no certificate is written"
        )
    return [[[as_text(x.real.mid()), as_text(x.imag.mid())] for x in pose[:-1]] for pose in found]


def check_count(mechanism: Json, groups: list[list[str]]) -> str:
    """Return what proves that modes are all: "" for theorems of the checker, or boxes."""
    try:
        counted(mechanism_of(mechanism, square=False), groups)
    except UnavailableError:
        if not (boxes := looked_at(mechanism, groups)):
            raise
        return boxes
    return ""


def looked_at(mechanism: Json, groups: list[list[str]]) -> str:
    """Return by what boxes it can be proved that modes are all: "turns", "places", "" by none.

    Groups of a spatial mechanism are bodies that a driver holds, and else bodies on hinges from
    known ones on (turns), or one body on distances from known points (places).
    """
    if mechanism.get("dimension") != 3:
        return ""
    m, known, proofs = mechanism_of(mechanism, square=False), {"ground"}, set[str]()
    for group in groups:
        known |= {*group}
        kinds = [joint["kind"] for joint in m.joints_of(group, known).values()]
        if len(kinds) > 1 or len(group) > 1:
            hung = "places" if {*kinds} == {"distance"} and len(group) == 1 else ""
            proofs.add("turns" if {*kinds} == {"revolute"} else hung)
    return proofs.pop() if len(proofs) == 1 else ""


def counted(m: ClaimedMechanism, groups: list[list[str]]) -> int:
    """Return how many poses groups have together, by the theorems of the checker."""
    count = Count(m, groups, IN_SPACE if m.dimension == 3 else IN_PLANE)
    for group, (most, _) in zip(groups, count.of_groups, strict=True):
        if not most:
            raise UnavailableError(
                "no certificate is written of modes of a group whose poses no theorem of the "
                f"checker counts: {', '.join(group)}",
                hint="docs/theory/certificates.md lists the groups that are counted",
            )
    return count.most


class PoseSearch:
    """The search for all complex poses of the groups in a certificate's `content`."""

    def __init__(self, content: Json) -> None:
        self.m: Any = mechanism_of(content["mechanism"])
        self.theorems: Theorems = IN_SPACE if self.m.dimension == 3 else IN_PLANE
        self.u, self.groups = exact(content["at"], "at"), content["groups"]
        self.count: int = counted(self.m, self.groups)
        self.rng = random.Random(7)

    def found(self, starts: list[Any], drawn: int = STARTS) -> list[list[Any]]:
        """Return up to `count` different poses in balls, from the starts and from random ones.

        As many random ones are `drawn` for each pose: they keep the first groups of a pose that is
        found, and draw the others.
        """
        found = list[list[Any]]()
        for k in range(len(starts) + min(drawn * self.count, MOST_STARTS)):
            if len(found) == self.count:
                break
            z = starts[k] if k < len(starts) else self._start(found)
            try:
                pose = solution(self.m, z).box()
            except ArithmeticError:
                continue
            mirrored = [acb(x.real, -x.imag) for x in pose]
            for image in (pose, mirrored):  # the mirror image of a pose is one
                if not any(self._alike(image, other) for other in found) and self.m.oriented(image):
                    found.append(image)
        return found

    def _alike(self, one: list[Any], other: list[Any]) -> bool:
        return self.theorems.alike(self.m, self.groups, one, other)

    def _start(self, found: list[list[Any]]) -> list[Any]:
        """Return a random complex place to begin from."""
        rng = self.rng
        bodies = {
            body for group in self.groups[: rng.randrange(len(self.groups))] for body in group
        }
        base, z = rng.choice(found) if found else None, []
        for k, (owner, _) in enumerate(self.m.names):
            if base is not None and owner in bodies:
                z.append(base[k])
            elif self.m.scale[k] == self.m.size:
                z.append(acb(rng.gauss(0, self.m.size), rng.gauss(0, self.m.size)))
            else:
                z.append(acb(rng.uniform(-3.2, 3.2), rng.gauss(0, 0.7)))
        return [*z, acb(self.u)]
