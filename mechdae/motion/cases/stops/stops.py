"""Where joints are beyond their limits, and where a motion meets a stop."""

from __future__ import annotations

from collections.abc import Callable, Collection

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.joints.joint import LIMITS
from mechdae.describe.joints.limits import limited
from mechdae.describe.units import shown
from mechdae.equations.model import Model
from mechdae.equations.reduction import Scene
from mechdae.kernels.run.functions import Batch
from mechdae.motion.continuation.any_path import AnyPath, arc_of
from mechdae.motion.continuation.evaluate import Evaluator, Poses
from mechdae.motion.continuation.follower import extend
from mechdae.motion.continuation.path import Path
from mechdae.motion.kinematics.assembled_arc import comes_back
from mechdae.motion.kinematics.finds import SAMPLES, SoughtOutput, at_place, named_poses, samples
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.types import Booleans, Floats, Integers, Json, Matrix, Sym, Unknowns

ROOM = 1e-9
"""By how much a joint may be beyond a limit by rounding [rad, sizes of the mechanism]."""
HAIR = 1e-6
"""Share of an arc by which stops at its ends are looked at from beyond."""
TURN = 2 * np.pi
Ends = list[float | None]
FREE = ("swing", "stroke", "limits")
"""What a summary says of the whole motion."""


class Stops:
    """The joints of a scene that have limits.

    An angle is within its limits if it is but for whole turns, unless the limits are a turn apart.
    """

    def __init__(
        self, model: Model, among: Collection[str], inputs: list[Sym], express: Callable[[Sym], Sym]
    ) -> None:
        joints = [joint for joint in limited(model.mechanism.joints) if joint.name in among]
        self.coordinates: list[NamedCoordinate] = [
            coordinate(model.mechanism, f"{joint.name}.{joint.ranged}") for joint in joints
        ]
        self.angles: Booleans = np.array([c.is_angle for c in self.coordinates])
        rows = [express(model.coordinate(c)) for c in self.coordinates]
        rows += [model.numbers[f"{joint.name}.{end}"] for end in LIMITS for joint in joints]
        function = ca.Function("stops", [*inputs, model.p], [ca.densify(ca.vertcat(*rows))])
        self._values = Batch(function, shared=[2])

    def off(self, x: Unknowns, u: Floats, p: Floats) -> tuple[Matrix, Matrix, Matrix]:
        """Return distances from the middle of the limits (n, k), half their widths, middles."""
        value, low, high = np.split(self._values(x, u, p)[0], 3, axis=1)
        middle, half = (low + high) / 2, (high - low) / 2
        off = value - middle
        whole = np.where(self.angles & (half < np.pi), TURN * np.round(off / TURN), 0.0)
        return off - whole, half, middle

    def over(
        self, scale: float, x: Unknowns, u: Floats, p: Floats
    ) -> tuple[Booleans, Callable[[int, int], str]]:
        """Return which joints are beyond a limit (n, k), and what is said of it by pose, joint."""
        off, half, middle = self.off(x, u, p)
        room = ROOM * np.where(self.angles, 1.0, scale)

        def sentence(n: int, k: int) -> str:
            c, side = self.coordinates[k], np.sign(off[n, k])
            word, end = c.text.rpartition(".")[2], "greatest" if side > 0 else "least"
            limit = shown(c.unit, middle[n, k] + side * half[n, k])
            return f"joint {c.part} is beyond its {end} {word} of {limit}"

        with np.errstate(invalid="ignore"):
            return np.asarray(np.abs(off) > half + room), sentence


def _stops(scene: Scene) -> Stops:
    def make() -> Stops:
        among = [name for group in scene.groups for name in group.joints]
        return Stops(scene.model, among, [scene.x, scene.u], scene.expression)

    found: Stops = scene.cache("stops", make)
    return found


def passed(model: Model, q: Unknowns, rebound: bool) -> tuple[Booleans, dict[str, int]]:
    """Return which released poses (n, nq) are beyond limits, what is said of it, where first.

    With `rebound` joints with a restitution are left out: they hit their stops.
    """
    joints = limited(model.mechanism.joints)
    among = [
        j.name for j in joints if not (rebound and getattr(j, "restitution", None) is not None)
    ]
    if not among:
        return np.zeros(len(q), bool), {}
    stops = Stops(model, among, [model.q, ca.SX(0, 1)], lambda expression: expression)
    over, sentence = stops.over(model.mechanism.scale, q, np.zeros((len(q), 0)), model.p_values)
    said = _by_sentence(over, sentence)
    return np.asarray(over.any(axis=1)), {text: rows[0] for text, rows in said.items()}


def _by_sentence(over: Booleans, sentence: Callable[[int, int], str]) -> dict[str, list[int]]:
    """Return what is said of limits -> the poses that are beyond them, each side for itself."""
    found: dict[str, list[int]] = {}
    for k, n in np.argwhere(over.T).tolist():
        found.setdefault(sentence(n, k), []).append(n)
    return found


def beyond(scene: Scene, x: Unknowns, u: Floats, p: Floats) -> dict[int, str]:
    """Return which limit poses (n, nx) are beyond, by row."""
    over, sentence = _stops(scene).over(scene.model.mechanism.scale, x, u, p)
    rows = np.flatnonzero(over.any(axis=1)).tolist()
    return {n: sentence(n, int(np.argmax(over[n]))) for n in rows}


class StopsAlong:
    """Where a path meets stops."""

    def __init__(self, setting: Setting, path: AnyPath, evaluator: Evaluator) -> None:
        self.setting, self.path, self.evaluator = setting, path, evaluator
        self.stops, self.begin = _stops(setting.scene), float(path.origin[0])

    def off(self, s: Floats) -> tuple[Matrix, Matrix, Matrix, Poses]:
        """Return what `Stops.off` gives at places (n,), and the poses."""
        poses = self.evaluator.at(self.path, s)
        found = self.stops.off(poses.x, self.path.drivers(s), self.setting.assembler.p)
        return *found, poses

    def met(self, s: Floats) -> list[tuple[float, float, int, int]]:
        """Return place, bound, sense and joint of stops between samples (n,)."""
        found = list[tuple[float, float, int, int]]()
        for k in range(len(self.stops.coordinates)):

            def margin(s: Floats, k: int = k) -> tuple[Floats, Floats, Floats]:
                off, half, _, poses = self.off(s)
                return half[:, k] - np.abs(off[:, k]), poses.condition, poses.places

            found += [(*each, k) for each in SoughtOutput.along(s, margin).crossings(0.0)]
        return found

    def event(self, run: Run, place: float, bound: float, sense: int, k: int) -> Json:
        """Return the event of a stop."""
        off, half, middle = (float(part[0, k]) for part in self.off(np.array([place]))[:3])
        side, c = float(np.sign(off)), self.stops.coordinates[k]
        return {
            "kind": "stop", **at_place(self.setting, run, place), "bound": bound, "in_range": True,
            "joint": c.part, "name": c.text, "of": c.text, "value": middle + side * half,
            "direction": "up" if side * sense < 0 else "down",
        }  # fmt: skip

    @property
    def counted(self) -> bool:
        """Whether turns of an angle count, so that a turn later the pose is another one."""
        half = self.off(np.array([self.begin]))[1][0]
        return bool((self.stops.angles & (half >= np.pi)).any())

    def turn(self) -> float | None:
        """Return a turn of the driver after which the first pose is back, None without."""
        plan, graphs, path = self.setting.plan, self.setting.graphs, self.path
        turns = graphs.single and graphs.turns and plan.by_value
        if not turns or not isinstance(path, Path) or self.counted:
            return None
        turn = TURN * float(self.setting.driver_sizes[plan.lead])
        extend(path, self.begin + turn, first=True)
        back = arc_of(path).ends[1] is None and comes_back(path, self.evaluator, turn)
        return turn if back else None

    def reach(self, s: Floats, turn: float | None) -> tuple[float, float]:
        """Return between which stops the start moves, infinite without; all from beyond a limit.

        Parameters
        ----------
        s
            Samples (n,) of the path.
        turn
            After which the first pose is back: then a stop ahead is one behind, too.
        """
        off, half, _, _ = self.off(np.array([self.begin]))
        if (np.abs(off) > half + ROOM).any():
            return -np.inf, np.inf
        if turn is not None:
            s = np.linspace(self.begin, self.begin + turn, SAMPLES)
        places = [place for place, *_ in self.met(s)]
        below = [place - (turn or 0.0) for place in places]
        low = max((place for place in below if place < self.begin), default=-np.inf)
        return low, min((place for place in places if place > self.begin), default=np.inf)


def cut(
    setting: Setting, path: Path, evaluator: Evaluator, places: Floats, ends: Ends
) -> tuple[Floats, Ends]:
    """Return the places of an assembled arc between the stops next to its start, and its ends."""
    along = StopsAlong(setting, path, evaluator)
    whole = ends == [None, None] and not along.counted
    s = np.unique([*places, *np.linspace(places[0], places[-1], SAMPLES), along.begin])
    reach = along.reach(s, float(places[-1] - places[0]) if whole else None)
    if not np.isfinite(reach).any():
        return places, ends
    first, last = np.where(np.isfinite(reach), reach, places[[0, -1]]).tolist()
    for place, way in ((last, HAIR), (first, -HAIR)):
        extend(path, place + 2 * way * (last - first))
    stops = [stop if np.isfinite(stop) else end for stop, end in zip(reach, ends, strict=True)]
    return np.linspace(first, last, len(places)), stops


def mark(setting: Setting, run: Run) -> None:
    """Mark the poses of a run with joints beyond their limits, with events where they meet one.

    So are poses that only a way through a stop leads to.
    """
    scene, p = setting.scene, setting.assembler.p
    along, stops = StopsAlong(setting, run.path, run.evaluator), _stops(scene)
    over, sentence = stops.over(scene.model.mechanism.scale, run.poses.x, run.values, p)
    said = _by_sentence(over, sentence)
    sentences = [f"{text} at {_some(setting, run, np.array(rows))}" for text, rows in said.items()]
    s = samples(run)
    if setting.plan.values is None:  # which ends at stops
        s = np.concatenate([s[:1] - HAIR * np.ptp(s), s, s[-1:] + HAIR * np.ptp(s)])
    met = along.met(s) if len(run.values) > 1 else []
    run.events += [along.event(run, *each) for each in met]
    meets = sorted({stops.coordinates[k].part for *_, k in met})
    run.stopped = np.asarray(over.any(axis=1))
    if met and (setting.plan.by_value or setting.graphs.nu == 1):  # else there are ways around
        behind = _behind(along, run) & ~run.stopped
        if behind.any():
            rows = np.flatnonzero(behind)
            sentences.append(f"a stop of {', '.join(meets)} is before {_some(setting, run, rows)}")
            run.stopped = run.stopped | behind
    for name in FREE if (meets or sentences) and setting.plan.values is not None else ():
        run.summary.pop(name, None)  # of the motion without stops
    if meets and setting.plan.values is not None:
        run.found.notes.append(f"{', '.join(FREE)} are not given: {', '.join(meets)} meets a stop")
    if sentences:
        run.fault = "; ".join(sentences)
        places = np.flatnonzero(over.any(axis=0)).tolist()
        run.summary["stopped"] = [stops.coordinates[k].part for k in places] or meets


def _some(setting: Setting, run: Run, rows: Integers) -> str:
    """Return the first of some poses, and how many more there are."""
    more = f" and {len(rows) - 1} more pose{'s' * (len(rows) > 2)}" if len(rows) > 1 else ""
    return f"{named_poses(setting, run, rows[:1])}{more}"


def _behind(along: StopsAlong, run: Run) -> Booleans:
    """Return which poses (n,) are reached from the start of the path only through a stop."""
    places, turn = np.asarray(run.places, float), along.turn()
    low, high = along.reach(samples(run), turn)
    room = ROOM * float(np.ptp(places))
    if turn is None:
        return np.asarray((places < low - room) | (places > high + room))
    ahead = (places - along.begin) % turn + along.begin
    return np.asarray((ahead > high + room) & (ahead - turn < low - room))
