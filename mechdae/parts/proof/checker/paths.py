"""Sweeps: the steps of a path, its limit positions and change points, and the poses on it."""

from __future__ import annotations

from collections.abc import Iterator

from flint import arb

from .arithmetic import LAST, ONE, ZERO, FalseClaim, Json, exact, field, need
from .crossings import Cone, across
from .mechanism import ClaimedMechanism
from .plane import PlanarMechanism
from .tubes import Tube, follow, solution, turning


def numbered(poses: list[object], start: arb, end: arb) -> str:
    """Return what is claimed of a path: its poses' numbers grow, so that none stands twice."""
    numbers = [field(pose, "pose", int, f"poses/{k}") for k, pose in enumerate(poses)]
    need(numbers == sorted({*numbers}), "poses", "one stands there twice, or they are out of order")
    ends = (at.str(9, radius=False) for at in (start, end))
    return f"from {' to '.join(ends)}, {len(numbers)} poses, of others nothing is claimed"


def intervals(steps: list[Json], start: arb) -> Iterator[tuple[str, Json, arb, arb]]:
    """Yield place, step, start and end of steps, of which each begins where another ended."""
    for k, step in enumerate(steps):
        at = f"path/steps/{k}"
        first, to = exact(field(step, "from", str, at), at), exact(step.get("to"), f"{at}/to")
        need(first == start < to, at, "begins where none ends, or leads back")
        yield at, step, start, to
        start = to


def compare_on_path(m: ClaimedMechanism, z: list[arb], claim: Json, at: str) -> None:
    """Compare what is reported with a pose of the path, at the drivers' values reported.

    Values of laws are rounded: the way goes straight on to those that are reported.
    """
    laws, reported = m.drivers, claim.get("drivers", {})
    values = {name: exact(text, at) for name, text in reported.items()}
    frames = m.placed(z) if z else None
    near = z and all(
        abs(m.coordinate(name, z, frames) - value) <= 1e-12 * (1 + m.size)
        for name, value in values.items()
    )
    need(near, at, "is not where the path is, or not at the values of the laws")
    for name, value in values.items():
        m.drivers = m.drivers | {name: m.straight(m.coordinate(name, z, frames), value)}
    if values:
        *_, (_, z) = follow(m, [*z[:LAST], ZERO], m.n, ONE)
    m.drivers = laws
    m.compare(z, claim, at)


class PathCheck:
    """A path that is followed step by step: its tubes, its ends, and what is between."""

    def __init__(self, m: ClaimedMechanism, data: Json) -> None:
        self.m, self.path = m, field(data, "path", dict, "certificate")
        start = solution(m, m.claimed(self.path, exact(self.path.get("at"), "path/at"), "path"))
        self.first = self.last = m.agrees(start.box(), self.path, "path")
        self.tubes: list[Tube | Cone] = [Tube(m, start.z, arb(2) ** -110, m.n, start.Y[0])]
        self.limits: dict[str, list[arb]] = {}
        self.crossed: int = 0
        steps = field(self.path, "steps", list, "path")
        for at, step, _, to in intervals(steps, self.first[LAST]):
            try:
                self._follow(step, to, at)
            except ArithmeticError as error:
                where = self.last[LAST].str(12)
                raise FalseClaim(at, f"not proved from {where} on: {error}") from None
            m.agrees(self.last, step, at)
        for word, sense, z in (("low", -1, self.first), ("high", 1, self.last)):
            if self.path.get(word) is not None:
                self._limit(word, sense, z)

    def _follow(self, step: Json, to: arb, at: str) -> None:
        """Follow a step, across a change point if it leads through one."""
        through = step.get("through")
        ways: Iterator[tuple[Tube | Cone, list[arb]]]
        if through is None:
            length = self.tubes[LAST].half * 4 if len(self.tubes) > 1 else None
            ways = follow(self.m, self.last, self.m.n, to, step=length)
        else:
            if not isinstance(self.m, PlanarMechanism):
                raise FalseClaim(at, "change points are checked in the plane")
            ways, self.crossed = (
                across(self.m, self.last, to, through, f"{at}/through"),
                self.crossed + 1,
            )
        for tube, self.last in ways:
            self.tubes.append(tube)

    def _limit(self, word: str, sense: int, z: list[arb]) -> None:
        """Find the limit position at an end of the path."""
        at, m, claim = f"path/{word}", self.m, self.path[word]
        u = exact(field(claim, "at", str, at), at)
        z = self.limits[word] = turning(m, z, m.claimed(claim, u, at), sense, at)
        need(abs(z[LAST] - u) <= 1e-12 * m.unit, f"{at}/at", f"it is at {z[LAST].str(20)}")
        m.agrees(z, claim, at)

    def compare(self, pose: Json, at: str) -> None:
        """Compare one pose: on the path, at a limit position, or behind one."""
        status, place = field(pose, "status", str, at), exact(field(pose, "at", str, at), at)
        near = [tube for tube in self.tubes if abs(place - tube.z[LAST]) <= tube.half][LAST:]
        if status == "ok" and near:
            compare_on_path(self.m, near[0].pose(place), pose, at)
        elif status == "limit" and pose.get("end") in self.limits:
            z = self.limits[pose["end"]]
            reached = abs(z[LAST] - place) <= 1e-12 * self.m.unit
            compare_on_path(self.m, z if reached else [], pose, at)
        else:
            below = "low" in self.limits and place < self.limits["low"][LAST]
            above = "high" in self.limits and place > self.limits["high"][LAST]
            behind = status == "unassembled" and (below or above)
            need(behind, at, f"{status[:40]!r} is not what the path says of it")


def check_sweep(m: ClaimedMechanism, data: Json) -> str:
    """Check the steps of a path, its limit positions, and the poses on it."""
    path = PathCheck(m, data)
    for k, pose in enumerate(field(data, "poses", list, "certificate")):
        path.compare(pose, f"poses/{k}")
    proved = [f"{len(path.tubes) - 1} steps"]
    if path.limits or not path.crossed:
        proved.append(f"{len(path.limits)} limit positions")
    if path.crossed:
        proved.append(f"{path.crossed} change points")
    proved.append(numbered(data["poses"], path.first[LAST], path.last[LAST]))
    corners = {len(law) for law in m.drivers.values() if m.dimension == 3 and isinstance(law, list)}
    need(len(corners) <= 1, "mechanism/drivers", "lists of values are not of one length")
    proved += [f"drivers with {corners.pop()} values each"] if corners else []
    if m.spins:
        proved.append(f"{len(m.spins)} spins chosen of what turns freely between two points")
    if m.left_out:
        proved.append(f"{len(m.left_out)} redundant equations off by {m.off:.1e}")
    return ", ".join(proved)
