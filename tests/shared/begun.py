"""First poses of one file by all kinds of tasks, its page, its exports and its designs.

A pose is told by places of points and rotations of bodies, by their names, whatever says it.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np

import mechdae as md
from mechdae.describe.tasks.goals import Minimise
from mechdae.describe.values import Table
from mechdae.design.synthesis.search import Search
from mechdae.design.synthesis.verify import Design, sketched
from mechdae.parts.exchange.robots.link_frames import of_quaternion

Pose: TypeAlias = dict[str, Any]
"""Places of points by "body.point", rotations of bodies by their name, one after the other."""
CLOSE = 1e-8
FINE = ("ok", "ambiguous")
"""Statuses of a first pose: both have values."""
SIGNED, RANKS = ("named", "silent", "held"), re.compile(r"(?<=[+-])[0-9]+")
"""Tasks that name modes by their signs alone where they are not counted in closed form."""
LAST = 1e-6
"""Seconds of motions that are asked for their first state alone."""


FURTHER = ("page", "export", "drawing", "design")
"""What begins with the pose of a sweep, and costs most."""


class Refused(Exception):
    """A task has no first pose, and says so in these words."""


def tasks_of(drivers: Mapping[str, float]) -> dict[str, Any]:
    """Return tasks that begin at driver values, given by coordinate."""
    held = tuple(md.Driver(text, at=[value]) for text, value in drivers.items())
    return {
        "sweep": md.Sweep(drivers=held),
        "forces": md.Reactions(drivers=held),
        "named": md.Motion(start=drivers, at=[0, LAST]),
        "silent": md.Motion(at=[0, LAST]),
        "held": md.Equilibrium(drivers=held),
        "modes": md.Modes(drivers=held),
    }


def pose_of(result: Any, k: int = 0) -> Pose:
    """Return the pose in row `k` of a result."""
    pose = {name: np.asarray(own.position[k], float) for name, own in result.points.items()}
    for name, own in result.bodies.items():
        if "orientation" in own:
            pose[name] = np.ravel(of_quaternion(own.orientation[k]))
        else:
            pose[name] = np.array([np.cos(own.angle[k]), np.sin(own.angle[k])])
    return pose


def apart(one: Pose, other: Pose, size: float = 1.0) -> float:
    """Return the largest difference of what two poses say, lengths over a size."""
    names = one.keys() & other.keys()
    if not names:
        return np.inf
    gaps = {n: float(np.abs(one[n] - other[n]).max()) for n in names}
    return max(gap / (size if "." in name else 1.0) for name, gap in gaps.items())


@dataclass
class First:
    """What the tasks of a file begin with: poses, or the words of those that refuse.

    ``labels`` are the modes that are named with the same drivers; ``drawn`` the places of joints
    in a drawing [m]; ``without`` counts what a mechanism of its kind does not have.
    """

    mechanism: md.Mechanism
    drivers: Mapping[str, float]
    number: str
    further: Sequence[str] = FURTHER
    poses: dict[str, Pose | str] = field(default_factory=dict)
    labels: dict[str, str] = field(default_factory=dict)
    drawn: Any = None
    without: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        tasks = tasks_of(self.drivers)
        self.problem = md.Problem(self.mechanism, tasks=Table(tasks))
        for name in tasks:
            if name != "modes":
                self._say(name, lambda name=name: self._solved(name))
        first = self.poses["sweep"]
        self.points = tuple(n for n in first if "." in n) if isinstance(first, dict) else ()
        self._say("modes", self._among_modes)
        own = md.Study(samples={self.number: [self._value]}, of="sweep", outputs=self._outputs)
        slopes = md.Sensitivity(of="sweep", outputs=self._outputs, wrt=(self.number,))
        self.problem = self.problem.with_task("study", own).with_task("slopes", slopes)
        self._say("study", lambda: self._table(md.solve(self.problem, "study").table, (0, 0)))
        self._say(
            "slopes", lambda: self._table(md.solve(self.problem, "slopes").data["values"], (0,))
        )
        further = {"page": self._of_page, "export": self._of_export}
        if self.mechanism.dimension == 2:
            further["drawing"] = self._of_drawing
        if len(self.drivers) == 1:
            further["design"] = self._of_design
        for name, pose in further.items():
            if name in self.further:
                self._say(name, pose)

    def _say(self, name: str, pose: Callable[[], Pose]) -> None:
        try:
            self.poses[name] = pose()
        except Refused as why:
            self.poses[name] = str(why)
        except md.UnavailableError:
            self.without.append(name)
        except md.MechdaeError as error:
            if name == "forces" and "teeth" in error.what:  # wheels that cannot be cut
                self.without.append(name)
                return
            self.poses[name] = f"{type(error).__name__}: {error.what}"

    @property
    def _outputs(self) -> tuple[str, ...]:
        names = self.points or [f"{b}.{p}" for b, own in self.mechanism.bodies.items()
                                for p in own.points][:1]  # fmt: skip
        return tuple(f"points/{name}/position" for name in names)

    @property
    def _value(self) -> float:
        return float(self.mechanism.values()[self.number])

    def _solved(self, name: str) -> Pose:
        result = md.solve(self.problem, name)
        if result.status[0] not in FINE:
            raise Refused(f"status {result.status[0]}")
        told = result.summary.get("mode_coordinates", list(self.drivers))
        if result.summary.get("mode") is not None and set(told) == set(self.drivers):
            self.labels[name] = str(result.summary["mode"])
        return pose_of(result)

    def _among_modes(self) -> Pose:
        """Return the pose among the modes that is the sweep's, the nearest one to it else."""
        result = md.solve(self.problem, "modes")
        poses = [pose_of(result, k) for k in range(len(result.status))]
        first = self.poses["sweep"]
        if result.fault is not None and "infinitely many modes" in result.fault:
            raise md.UnavailableError(result.fault)
        if not poses or isinstance(first, str):
            raise Refused(f"{len(poses)} modes")
        best = min(range(len(poses)), key=lambda k: apart(first, poses[k]))
        if result.labels is not None:
            self.labels["modes"] = ",".join(result.labels[best])
        self._say("pasted", lambda: self._pasted(result.summary["sketches"][best]))
        return poses[best]

    def _pasted(self, lines: Mapping[str, Any]) -> Pose:
        """Return the first pose of the mechanism with the sketch that is offered of a mode."""
        told = {n.removesuffix("_deg"): np.radians(v) if n.endswith("_deg") else v
                for n, v in lines.items()}  # fmt: skip
        mechanism = replace(self.mechanism, sketch=Table(told))
        result = md.solve(mechanism, self.problem.tasks["sweep"])
        if result.status[0] not in FINE:
            raise Refused(f"status {result.status[0]}")
        return pose_of(result)

    def _table(self, table: Mapping[str, Any], row: tuple[int, ...]) -> Pose:
        pose = {name.split("/")[1]: np.asarray(rows[row], float) for name, rows in table.items()}
        if not all(np.isfinite(at).all() for at in pose.values()):
            raise Refused("no values")
        return pose

    def _of_page(self) -> Pose:
        """Return the pose that a page has recorded; its own mode is the one it begins with."""
        data = md.page(self.problem, "sweep").data
        if data["status"][0] not in FINE:
            raise Refused(f"status {data['status'][0]}")
        own = [mode for mode in data.get("modes") or () if mode["own"]]
        for mode in own:
            gap = np.subtract(mode["x"], data["start"]["x"])
            assert np.abs(gap).max(initial=0.0) < 1e-6 * max(1.0, np.abs(mode["x"]).max(initial=0))
            self.labels["page"] = str(mode["label"])
        points = data["recorded"]["points"]
        return {n: np.array(own[: self.mechanism.dimension], float) for n, own in points.items()}

    def _of_export(self) -> Pose:
        """Return the places of sites of a model for MuJoCo in its own pose."""
        (text,) = md.export(self.problem, format="mjcf", task="sweep").files.values()
        world = ET.fromstring(text).find("worldbody")
        found: Pose = {}
        _walk(world, np.eye(3), np.zeros(3), found)
        return {n: at[: self.mechanism.dimension] for n, at in found.items() if n in self.points}

    def _of_drawing(self) -> Pose:
        """Return for each joint that is drawn the point that lies nearest, and where it is."""
        (text,) = md.export(self.problem, format="dxf", task="sweep").files.values()
        lines = [line.strip() for line in text.splitlines()]
        first, pose = self.poses["sweep"], {}
        if isinstance(first, str):
            raise Refused(first)
        values = self.mechanism.values()
        ground = [
            np.array([values[f"ground.{name}.{axis}"] for axis in "xy"])
            for name in self.mechanism.ground.points
        ]
        for i, line in enumerate(lines):
            if line == "CIRCLE" and lines[i + 2] == "JOINTS":
                at = np.array([float(lines[i + 4]), float(lines[i + 6])]) / 1000
                if any(np.abs(pin - at).max() < CLOSE for pin in ground):
                    continue  # a wheel about a pin of the ground
                near = min(self.points, key=lambda n: float(np.abs(first[n] - at).max()))
                pose[near] = at
        return pose or {self.points[0]: first[self.points[0]]}

    def _of_design(self) -> Pose:
        """Return the first pose of the file of a design with the numbers of the mechanism."""
        ((driver, value),) = self.drivers.items()
        near = 0.1 * self.mechanism.scale
        free = {self.number: [self._value - near, self._value + near]}
        for point in self.points:  # the goal has to depend on the number
            goal = Minimise(of=f"sweep/points/{point}/position")
            task = md.Synthesis(driver={"coordinate": driver}, goal=goal, free=free, starts=1)
            problem = self.problem.with_task("design", task)
            try:
                space = Search(problem, task).space
            except md.InputError:
                continue
            break
        else:
            raise md.UnavailableError("nothing depends on the number")
        found = sketched(problem, space, np.array([self._value]), value)
        if found is None:
            raise Refused("no start")
        u, x = found
        given = {"choice": np.zeros(0)}
        design = Design(problem, space, {"d": np.array([self._value])}, given, [u], x)
        result, faults = design.file.swept([u], self.points)
        if result is None or faults:
            raise Refused("; ".join(faults))
        return pose_of(result)

    def wrong(self) -> list[str]:
        """Return which tasks begin elsewhere than the sweep, or refuse where it does not."""
        first, wrong, size = self.poses["sweep"], [], self.mechanism.scale
        for name, pose in self.poses.items():
            if isinstance(first, str) or isinstance(pose, str):
                if isinstance(first, str) != isinstance(pose, str):
                    said = [v if isinstance(v, str) else "a pose" for v in (first, pose)]
                    wrong.append(f"sweep: {said[0]}; {name}: {said[1]}")
            elif not apart(first, pose, size) < CLOSE:
                wrong.append(f"{name} is {apart(first, pose, size):.3g} from the sweep")
        full = {own for task, own in self.labels.items() if task not in SIGNED}
        if len(full) > 1 or len({RANKS.sub("", own) for own in self.labels.values()}) > 1:
            wrong.append(f"modes are called {self.labels}")
        return wrong


def _walk(node: Any, R: Any, r: Any, found: Pose) -> None:
    for site in node.findall("site"):
        found[site.get("name")] = r + R @ np.array(site.get("pos").split(), float)
    for body in node.findall("body"):
        q = np.array((body.get("quat") or "1 0 0 0").split(), float)
        at = r + R @ np.array(body.get("pos", "0 0 0").split(), float)
        _walk(body, R @ of_quaternion(q), at, found)
