"""What variants are ranked by: criteria with unit and sense, and how they follow from results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from mechdae.describe import GROUND, Mechanism, Problem, Sweep, coordinate
from mechdae.describe.assumed import usual_speed
from mechdae.describe.loads import Resistance
from mechdae.describe.series_units import WEAR
from mechdae.describe.tasks.motion import Reactions
from mechdae.errors import InputError
from mechdae.parts.types.chains.variants.scheme import moves
from mechdae.records import dataclass
from mechdae.types import Matrix

Get = Callable[[str], Any]
"""Path below the task -> its array."""
RATES = ("peak_acceleration", "shaking_force", "shaking_moment", "loss", "peak_pv", "mean_pv")
"""Criteria that depend on how fast the driver moves."""


@dataclass(frozen=True)
class Criterion:
    """A number of a variant; ``sense`` "min" where less is better, "max" where more is."""

    name: str
    unit: str
    sense: str
    paths: tuple[str, ...]
    value: Callable[[Get, Mapping[str, float]], float]
    """From what `paths` name and the mechanism's values."""

    def to_dict(self) -> dict[str, str]:
        """Return name, unit and sense."""
        return {"name": self.name, "unit": self.unit, "sense": self.sense}


def measured(mechanism: Mechanism, task: object) -> Any:
    """Return a task of the plane with the measures that criteria need, also where it has none."""
    if not isinstance(task, Sweep) or mechanism.dimension != 2 or not moves(task):
        return task
    more = ("envelope", "transmission") if _dyads(mechanism) else ("envelope",)
    return replace(task, measures=tuple(dict.fromkeys((*(task.measures or ()), *more))))


class Criteria:
    """The criteria that a task of a mechanism gives.

    `output`: coordinate whose acceleration counts; absent: that of the first resistance, or else of
    the last link on the ground that is not driven.
    """

    def __init__(self, problem: Problem, name: str, output: str | None = None) -> None:
        task = problem.tasks[name]
        if not isinstance(task, Sweep) or len(task.all_drivers) != 1:
            raise InputError(
                "variants are ranked by a sweep or reactions with one driver",
                where=f"tasks.{name}",
            )
        self.mechanism, self.task = problem.mechanism, task
        self.output: str | None = output or self._output()

    @cached_property
    def all(self) -> dict[str, Criterion]:
        """The criteria by name, sizes first."""
        found = [*self._sizes(), *self._motion(), *self._inertia()]
        if isinstance(self.task, Reactions):
            found += [*self._forces(self.task)]
        pace = usual_speed(self.mechanism, self.task)
        for k, criterion in enumerate(found if pace else []):  # rates of a speed that nobody gave
            if criterion.name in RATES:
                found[k] = replace(criterion, unit=f"{criterion.unit} at {pace}")
        return {criterion.name: criterion for criterion in found}

    # -- size --------------------------------------------------------------------------------

    def _sizes(self) -> list[Criterion]:
        found = []
        if moves(self.task) and "envelope" in (self.task.measures or ()):
            path = "summary/envelope/all"
            for name, k in (("width", 0), ("height", 2)):
                found.append(Criterion(name, "m", "min", (path,), _side(path, k)))
        if {"layer", "layers"} <= set(self.mechanism.parameters):
            found.append(Criterion("layers", "1", "min", (), lambda _, v: v["layers"]))
            found.append(Criterion("depth", "m", "min", (), lambda _, v: v["layers"] * v["layer"]))
        mechanism = self.mechanism
        found.append(
            Criterion("lengths", "m", "min", (), lambda _, values: _lengths(mechanism, values))
        )
        return found

    # -- motion ------------------------------------------------------------------------------

    def _motion(self) -> list[Criterion]:
        found = []
        dyads = _dyads(self.mechanism)
        if moves(self.task) and "transmission" in (self.task.measures or ()) and dyads:
            found.append(
                Criterion("transmission_angle", "rad", "max", ("summary/transmission",), _least)
            )
        if self.output is not None and self.task.derivatives >= 2:
            path, unit = self._acceleration(self.output)
            found.append(Criterion("peak_acceleration", unit, "min", (path,), _peak(path)))
        return found

    def _output(self) -> str | None:
        """Return the coordinate that counts as the output."""
        for load in self.mechanism.loads.values():
            if isinstance(load, Resistance):
                return load.coordinate
        driver = self.task.all_drivers[0].coordinate.rpartition(".")[0]
        for joint in reversed(list(self.mechanism.joints.values())):
            ends = (joint.first_body, joint.second_body)
            if GROUND in ends and driver not in (*ends, joint.name):
                body = ends[1] if ends[0] == GROUND else ends[0]
                return f"{joint.name}.slide" if joint.guide else f"{body}.angle"
        return None

    def _acceleration(self, text: str) -> tuple[str, str]:
        """Return the path of an output's acceleration, and its unit."""
        named = coordinate(self.mechanism, text)
        joint = self.mechanism.joints.get(named.part)
        if named.kind == "body angle":
            return f"bodies/{named.part}/angular_acceleration", "rad/s2"
        if named.kind == "slide":
            return f"joints/{named.part}/slide_acceleration", "m/s2"
        if joint is not None and joint.first_body == GROUND and named.kind == "joint angle":
            return f"bodies/{joint.second_body}/angular_acceleration", "rad/s2"
        raise InputError(
            f"'{text}' is no output here: the angle of a body, or a slide", where="output"
        )

    # -- inertia -----------------------------------------------------------------------------

    def _inertia(self) -> list[Criterion]:
        """Return what the masses do to the frame: the sum of all m a, and of its moments."""
        values = self.mechanism.values()
        heavy = [name for name in self.mechanism.bodies if values.get(f"{name}.mass", 0.0)]
        if not heavy or self.task.derivatives < 2:
            return []
        points = {name: next(iter(self.mechanism.bodies[name].points), None) for name in heavy}
        if None in points.values():
            return []
        paths = tuple(
            path
            for name, point in points.items()
            for path in (
                f"bodies/{name}/angle",
                f"bodies/{name}/angular_velocity",
                f"bodies/{name}/angular_acceleration",
                f"points/{name}.{point}/position",
                f"points/{name}.{point}/acceleration",
            )
        )

        def force(get: Get, numbers: Mapping[str, float]) -> float:
            return float(np.linalg.norm(_shaking(get, numbers, points)[0], axis=-1).max())

        def moment(get: Get, numbers: Mapping[str, float]) -> float:
            return float(np.abs(_shaking(get, numbers, points)[1]).max())

        return [
            Criterion("shaking_force", "N", "min", paths, force),
            Criterion("shaking_moment", "N m", "min", paths, moment),
        ]

    # -- forces ------------------------------------------------------------------------------

    def _forces(self, task: Reactions) -> list[Criterion]:
        driver = task.all_drivers[0].coordinate
        effort = f"efforts/{driver}"
        unit = "N m" if coordinate(self.mechanism, driver).is_angle else "N"
        joints = [name for name, joint in self.mechanism.joints.items() if not joint.meshes]
        reactions = tuple(f"joints/{name}/reaction" for name in joints)

        def most(get: Get, _: Mapping[str, float]) -> float:
            return max(float(_force(get, path).max()) for path in reactions)

        found = [
            Criterion("peak_effort", unit, "min", (effort,), _peak(effort)),
            Criterion("rms_effort", unit, "min", (effort,), _rms(effort)),
            Criterion("peak_reaction", "N", "min", reactions, most),
        ]
        pins = [name for name in joints if f"{name}_bearing" in self.mechanism.parameters]
        if pins:
            paths = tuple(f"joints/{name}/reaction" for name in pins)

            def bearing(get: Get, values: Mapping[str, float]) -> float:
                shares = [values[f"{name}_bearing"] for name in pins]
                loads = [_force(get, path).max() for path in paths]
                return float(max(s * load for s, load in zip(shares, loads, strict=True)))

            found.append(Criterion("bearing_load", "N", "min", paths, bearing))
        if task.cycle:
            for word, sense, name_unit in (("loss", "min", "W"), ("efficiency", "max", "1")):
                path = f"summary/{word}"
                found.append(Criterion(word, name_unit, sense, (path,), _number(path)))
            worn = [n for n in joints if getattr(self.mechanism.joints[n], "face_width", None)]
            for word, name_unit in WEAR.items() if worn else ():  # where they are largest
                each = tuple(f"summary/wear/{name}/{word}" for name in worn)
                found.append(Criterion(word, name_unit, "min", each, _largest(each)))
        rubs = any(getattr(joint, "friction", None) for joint in self.mechanism.joints.values())
        if rubs and task.friction == "coupled":
            path = "summary/critical_factor/factor"
            found.append(Criterion("friction_margin", "1", "max", (path,), _number(path)))
        return found


def _side(path: str, k: int) -> Callable[[Get, Mapping[str, float]], float]:
    def side(get: Get, _: Mapping[str, float]) -> float:
        box = get(path)
        return float(box[k + 1] - box[k])

    return side


def _number(path: str) -> Callable[[Get, Mapping[str, float]], float]:
    return lambda get, _: float(get(path))


def _largest(paths: tuple[str, ...]) -> Callable[[Get, Mapping[str, float]], float]:
    return lambda get, _: max(float(get(path)) for path in paths)


def _peak(path: str) -> Callable[[Get, Mapping[str, float]], float]:
    return lambda get, _: float(np.abs(np.asarray(get(path), float)).max())


def _rms(path: str) -> Callable[[Get, Mapping[str, float]], float]:
    """Return the root of the mean square over the poses, by the trapezoidal rule."""

    def rms(get: Get, _: Mapping[str, float]) -> float:
        squares = np.asarray(get(path), float) ** 2
        if len(squares) < 2:
            return float(np.sqrt(squares.mean()))
        return float(np.sqrt(((squares[1:] + squares[:-1]) / 2).mean()))

    return rms


def _least(get: Get, _: Mapping[str, float]) -> float:
    return min(float(angle["min"]) for angle in get("summary/transmission").values())


def _force(get: Get, path: str) -> Any:
    return np.linalg.norm(np.asarray(get(path), float)[:, :2], axis=1)


def _shaking(
    get: Get, values: Mapping[str, float], points: Mapping[str, str | None]
) -> tuple[Any, Any]:
    """Return the sum of m a of all links (n, 2), and of moments of it about the origin (n,)."""
    force: float = 0.0
    moment: Any = 0.0
    for name, point in points.items():
        head = f"bodies/{name}"
        angle, speed, acceleration = (
            np.asarray(get(f"{head}/{word}"), float)
            for word in ("angle", "angular_velocity", "angular_acceleration")
        )
        place, origin = (
            np.asarray(get(f"points/{name}.{point}/{word}"), float)
            for word in ("position", "acceleration")
        )
        x, y = (values.get(f"{name}.center.{a}", 0.0) - values[f"{name}.{point}.{a}"] for a in "xy")
        arm = np.stack(
            [x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)], axis=1
        )
        across = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
        centre = origin + acceleration[:, None] * across - speed[:, None] ** 2 * arm
        r, mass = place + arm, values[f"{name}.mass"]
        force = force + mass * centre
        moment = moment + mass * (r[:, 0] * centre[:, 1] - r[:, 1] * centre[:, 0])
        moment = moment + values.get(f"{name}.inertia", 0.0) * acceleration
    return force, moment


def _lengths(mechanism: Mechanism, values: Mapping[str, float]) -> float:
    """Return the sum over all links, the frame too, of the shortest lines through their joints."""
    total = 0.0
    for name in (GROUND, *mechanism.bodies):
        ends = {
            end
            for joint in mechanism.joints.values()
            for end in (joint.first, joint.second)
            if end.partition(".")[0] == name
        }
        places = sorted({(values[f"{end}.x"], values[f"{end}.y"]) for end in ends})
        total += _tree(np.array(places))
    return total


def _tree(places: Matrix) -> float:
    """Return the length of the shortest tree of straight lines through points (Prim)."""
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    nearest, total = apart[0].copy(), 0.0
    left = set(range(1, len(places)))
    while left:
        k = min(left, key=nearest.__getitem__)
        total += float(nearest[k])
        left.discard(k)
        nearest = np.minimum(nearest, apart[k])
    return total


def _dyads(mechanism: Mechanism) -> bool:
    """Return whether there may be a transmission angle at all."""
    return len(mechanism.bodies) > 1
