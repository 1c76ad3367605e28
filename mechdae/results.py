"""Results: read-only arrays with names and units, the same content as the JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from mechdae.describe.mechanism import Mechanism
from mechdae.describe.quantity import unit_of
from mechdae.describe.tasks.kinds import Task
from mechdae.errors import UnknownName

UNITS = {
    "position": "m",
    "velocity": "m/s",
    "acceleration": "m/s2",
    "angle": "rad",
    "angular_velocity": "rad/s",
    "angular_acceleration": "rad/s2",
    "slide": "m",
    "slide_velocity": "m/s",
    "slide_acceleration": "m/s2",
    "coriolis": "m/s2",
    "s": "1",
    "s_velocity": "1/s",
    "s_acceleration": "1/s2",
    "s_jerk": "1/s3",
    "jerk": "m/s3",
    "angular_jerk": "rad/s3",
    "slide_jerk": "m/s3",
    "transmission_angle": "rad",
    "tangent": "rad",
    "curvature": "1/m",
    "centrode_fixed": "m",
    "centrode_moving": "m",
    "loss": "W",
    "loss_uncoupled": "W",
    "normal": "N",
    "energy": "J",
    "kinetic": "J",
    "potential": "J",
    "drift": "1",
}

_WHOLE = (("Fx", "Fy", "M"), ("N", "N", "N m"))
REACTION = {
    **dict.fromkeys(("", "uncoupled", "static", "inertial", "body"), _WHOLE),
    "radial": (("Fr", "Ft"), ("N", "N")),
}
"""Names and units of a reaction's components by the last word of its name."""
SUMMARY = {
    "swing": "rad",
    "stroke": "m",
    "return_angle": "rad",
    "time_ratio": "1",
    "useful": "W",
    "loss": "W",
    "input": "W",
    "efficiency": "1",
    "efficiency_uncoupled": "1",
    "efficiency_formula_10": "1",
    "frequencies": "Hz",
    "damping": "1",
    "settling_time": "s",
    "envelope": "m",
}
"""Units of entries of a summary."""
OUTPUT_RATES = ("value", "rate", "second", "third")
DRIVER_UNITS = {"velocity": "/s", "acceleration": "/s2", "jerk": "/s3"}
PLURALS = {
    "body": "bodies",
    "point": "points",
    "joint": "joints",
    "driver": "drivers",
    "output": "outputs",
}
HISTORY = ("last", "highest", "lowest", "peak", "settling")
"""First steps of paths that give one number of a motion's time history."""
KINDS = ("drivers", "bodies", "points", "joints", "outputs")


class Series(Mapping[str, Any]):
    """Arrays of one body, point, joint or driver, by attribute or key; rows are poses."""

    def __init__(self, arrays: Mapping[str, Any]) -> None:
        frozen = {}
        for name, value in arrays.items():
            array = np.asarray(value)
            array.setflags(write=False)
            frozen[name] = array
        self.__dict__["_arrays"] = frozen

    def __getattr__(self, name: str) -> Any:
        arrays = self.__dict__["_arrays"]
        if name not in arrays:
            raise AttributeError(f"no '{name}' here; there is {', '.join(arrays)}")
        return arrays[name]

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError("results are read-only")

    def __getitem__(self, name: str) -> Any:
        return self.__dict__["_arrays"][name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.__dict__["_arrays"])

    def __len__(self) -> int:
        return len(self.__dict__["_arrays"])

    def __repr__(self) -> str:
        return f"Series({', '.join(self)})"


class Named(Mapping[str, Series]):
    """Series by name; an unknown name is answered with the nearest ones."""

    def __init__(self, kind: str, items: Mapping[str, Series]) -> None:
        self._kind, self._items = kind, dict(items)

    def __getitem__(self, name: str) -> Series:
        if name not in self._items:
            raise UnknownName(self._kind, name, self._items)
        return self._items[name]

    def get(self, name: str, default: Any = None) -> Any:
        """Return the series of that name, or the default."""
        return self._items.get(name, default)

    def __contains__(self, name: object) -> bool:
        return name in self._items

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __repr__(self) -> str:
        return f"{PLURALS[self._kind]}: {', '.join(self)}"


@dataclass(frozen=True)
class Result:
    """What one task gave; rows are poses (assembly modes for a task of kind modes).

    Attributes
    ----------
    drivers, bodies, points, joints, outputs
        Named series, SI and radians; nan where a pose has no value. `outputs` are those that
        the problem names.
    centres
        Instant centres (n, 2) [m] of pairs of bodies, ``crank-rocker``.
    status : (n,) array of str
        ok, limit, unassembled, singular, ambiguous.
    bound
        length (n,) [m] and angle (n,) [rad]: distance to the exact solution at most.
    condition : (n,) array
        Condition number of the worst block; near a limit rates lose that many digits.
    fault
        What is wrong with the answer, None when nothing is.
    parameters, table
        Of a study, whose rows are sets of parameters: name -> (n,), path -> (n, ...).
    time : (n,) array
        The times of the poses where the drivers follow laws, else None [s].
    efforts
        Of a task of reactions: torque or force conjugate to each driver, (n,) by its name;
        ``parts`` has further ones by word: uncoupled, static, inertial.
    solutions
        All solutions of the poses that have several.
    data
        Of a sensitivity: values, derivatives and what tolerances do, by path and name.
    scalars, work
        Of a motion: energy, kinetic, potential [J] and drift (the largest gap of a constraint over
        a length of the mechanism), (n,) each; work since t = 0 by load [J].
    unique
        Where constraints are superfluous: unique directions of a joint's reaction, the values
        along them, the frame of the directions.
    """

    problem: str
    task: str
    kind: str
    mechanism: Mechanism
    title: str = ""
    drivers: Named = field(default_factory=lambda: Named("driver", {}))
    bodies: Named = field(default_factory=lambda: Named("body", {}))
    points: Named = field(default_factory=lambda: Named("point", {}))
    joints: Named = field(default_factory=lambda: Named("joint", {}))
    outputs: Named = field(default_factory=lambda: Named("output", {}))
    centres: Series = field(default_factory=lambda: Series({}))
    status: Any = None
    bound: Series = field(default_factory=lambda: Series({}))
    condition: Any = None
    labels: tuple[tuple[str, ...], ...] | None = None
    events: tuple[dict[str, Any], ...] = ()
    checks: dict[str, Any] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    fault: str | None = None
    definition: Task | None = None
    parameters: dict[str, Any] = field(default_factory=dict)
    table: dict[str, Any] = field(default_factory=dict)
    time: Any = None
    efforts: Series = field(default_factory=lambda: Series({}))
    parts: dict[str, Series] = field(default_factory=dict)
    solutions: tuple[dict[str, Any], ...] = ()
    unique: dict[str, dict[str, Any]] = field(default_factory=dict)
    data: dict[str, Any] = field(default_factory=dict)
    scalars: Series = field(default_factory=lambda: Series({}))
    work: Series = field(default_factory=lambda: Series({}))

    def _parts(self) -> list[tuple[str, Series]]:
        return [(f"efforts_{word}", series) for word, series in self.parts.items()]

    def __len__(self) -> int:
        return len(self.status)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, as in the JSON of this task (nan as None)."""
        result: dict[str, Any] = {"kind": self.kind}
        if self.time is not None:
            result["time"] = plain(self.time)
        for name in KINDS:
            table = getattr(self, name)
            if table:
                result[name] = {
                    part: {key: plain(array) for key, array in series.items()}
                    for part, series in table.items()
                }
        for joint, own in self.unique.items():
            result["joints"].setdefault(joint, {})["unique"] = plain(own)
        for word, series in (("efforts", self.efforts), *self._parts()):
            if series:
                result[word] = {name: plain(array) for name, array in series.items()}
        result |= {name: plain(array) for name, array in self.scalars.items()}
        if self.work:
            result["work"] = {name: plain(array) for name, array in self.work.items()}
        for name in ("parameters", "table"):
            arrays = getattr(self, name)
            if arrays:
                result[name] = {key: plain(np.asarray(array)) for key, array in arrays.items()}
        for name, entries in self.data.items():
            result[name] = plain(entries)
        if self.centres:
            result["centres"] = {pair: plain(array) for pair, array in self.centres.items()}
        if self.labels is not None:
            result["labels"] = [list(row) for row in self.labels]
        result["status"] = [str(text) for text in self.status]
        result["bound"] = {key: plain(array) for key, array in self.bound.items()}
        if self.condition is not None:
            result["condition"] = plain(self.condition)
        result["events"] = [plain(event) for event in self.events]
        if self.solutions:
            result["solutions"] = [plain(entry) for entry in self.solutions]
        if self.checks:
            result["checks"] = plain(self.checks)
        result["summary"] = plain(self.summary)
        if self.fault:
            result["summary"]["fault"] = self.fault
        return result

    @cached_property
    def _plain(self) -> dict[str, Any]:
        return self.to_dict()

    def value(self, path: str) -> Any:
        """Return the plain data at a slash path below the task (``points/rod.B/velocity``).

        A named output stands for its value, or is the first step of a path; a number is a place
        in a list (``summary/frequencies/0``).

        Raises
        ------
        UnknownName
            With the nearest names on that level.
        """
        here: Any = self._plain
        for step in self.whole_path(path).split("/"):
            if isinstance(here, list) and step.isdigit() and int(step) < len(here):
                here = here[int(step)]
                continue
            if not isinstance(here, dict) or step not in here:
                raise UnknownName("path", path, list(here) if isinstance(here, dict) else [])
            here = here[step]
        return here

    def whole_path(self, path: str) -> str:
        """Return the path a named output stands for (``Theta``, ``Theta/rate``), else `path`."""
        name, _, rest = path.partition("/")
        if name in self.outputs and name not in self.__dataclass_fields__:
            return f"outputs/{name}/{rest or 'value'}"
        return path

    def columns(self) -> Iterator[tuple[str, str, Any]]:
        """Yield (name, unit, (n,) array) for every scalar series, time and drivers first."""
        if self.time is not None:
            yield "time", "s", self.time
        for kind in KINDS:
            for part, series in getattr(self, kind).items():
                for name, array in series.items():
                    unit = self.unit(kind, part, name)
                    if array.ndim == 1:
                        yield f"{part}.{name}", unit, array
                    elif name.startswith("reaction"):
                        for axis, own, column in zip(*REACTION[name[9:]], array.T, strict=True):
                            yield f"{part}.{name}.{axis}", own, column
                    else:
                        for axis, column in zip("xyz", array.T, strict=False):
                            yield f"{part}.{name}.{axis}", unit, column
        for word, series in (("effort", self.efforts), *self._parts()):
            for name, array in series.items():
                turns = name.endswith(".angle")
                yield f"{word.replace('efforts', 'effort')}.{name}", "N m" if turns else "N", array
        for name, array in self.scalars.items():
            yield name, UNITS[name], array
        for name, array in self.work.items():
            yield f"work.{name}", "J", array
        units = self.summary.get("units", {})
        for name, array in self.parameters.items():
            yield name, units.get(name, ""), array
        for path, array in self.table.items():
            yield from _flat(path, array, self.path_unit(path))
        for path, slopes in self.data.get("derivatives", {}).items():
            for name, array in slopes.items():
                if np.shape(array)[:1] == np.shape(self.status):
                    for word, _, column in _flat(path, np.asarray(array), ""):
                        yield f"d {word} / d {name}", "", column
        yield from _of_designs(self.data.get("designs", ()))
        for pair, array in self.centres.items():
            for axis, column in zip("xyz", array.T, strict=False):
                yield f"centre.{pair}.{axis}", "m", column
        for name, unit in (("length", "m"), ("angle", "rad")):
            if name in self.bound:
                yield f"bound.{name}", unit, self.bound[name]
        if self.condition is not None:
            yield "condition", "1", self.condition

    def unit(self, kind: str, part: str, name: str) -> str:
        """Return the unit of a series: of "drivers" by the coordinate, else by its name.

        That of a named output is empty where it does not follow from its expression.
        """
        if kind == "outputs":
            return unit_of(self.mechanism, part, OUTPUT_RATES.index(name))
        if kind != "drivers":
            return UNITS.get(name, "1")
        base = {"angle": "rad", "s": "1"}.get(part.rpartition(".")[2], "m")
        return base + DRIVER_UNITS.get(name, "")

    def path_unit(self, path: str) -> str:
        """Return the unit of what a path of a study names; empty where it is not known."""
        word, _, rest = path.partition("/")
        if word in HISTORY:
            return "s" if word == "settling" else self.path_unit(rest)
        head, _, rest = self._named(path).partition("/")
        part, _, name = rest.rpartition("/")
        if head in KINDS and part:
            return "" if name.startswith("reaction") else self.unit(head, part, name)
        if head.startswith("efforts"):
            return "N m" if rest.endswith(".angle") else "N"
        if head == "summary":
            return self._summary_unit(rest.split("/"))
        if head == "work":
            return "J"
        return UNITS.get(path.rsplit("/", 1)[-1], "")

    def _named(self, path: str) -> str:
        """Return the path a name of the problem's outputs stands for, also of a study."""
        name, _, rest = path.partition("/")
        if name in self.mechanism.outputs and name not in self.__dataclass_fields__:
            return f"outputs/{name}/{rest or 'value'}"
        return path

    def _summary_unit(self, steps: list[str]) -> str:
        """Return the unit of an entry of the summary."""
        word, last = steps[0], steps[-1]
        if word in SUMMARY:
            return SUMMARY[word]
        if word.startswith("loss_by_joint"):
            return "W"
        if word == "transmission" and last in ("min", "max"):
            return "rad"
        if word == "extremes" and last == "value":
            return "rad" if steps[1].endswith(".angle") else "m"
        if word == "curve":
            return {"length": "m", "area": "m2"}.get(last, "")
        if word == "state" and steps[1:2] and steps[1] in self.mechanism.outputs:
            return self.unit("outputs", steps[1], "value")
        return ""


def _flat(path: str, array: Any, unit: str) -> Iterator[tuple[str, str, Any]]:
    """Yield the numbers of each row of a study as columns ``path[i][j]``."""
    word = path.rpartition("/")[2]
    axes = REACTION.get(word[9:], _WHOLE)[1] if word.startswith("reaction") else ()
    for place in np.ndindex(*array.shape[1:]):
        name = path + "".join(f"[{i}]" for i in place)
        own = axes[place[-1]] if axes and place and place[-1] < len(axes) else unit
        yield name, own, array[(slice(None), *place)]


def _of_designs(designs: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, str, Any]]:
    """Yield objective, transmission angle, hits and dimensions of the designs of a synthesis."""
    if not designs:
        return
    for name, unit in (("objective", ""), ("transmission_angle_min", "rad"), ("hits", "1")):
        values = [design.get(name) for design in designs]
        if any(value is not None for value in values):
            yield name, unit, np.array([np.nan if v is None else float(v) for v in values])
    for name in dict.fromkeys(name for design in designs for name in design["parameters"]):
        yield name, "", np.array([design["parameters"].get(name, np.nan) for design in designs])


def plain(value: Any) -> Any:
    """Return lists, floats, ints and None for arrays, numpy scalars and nan."""
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f":
            return plain(value.tolist())
        return value.tolist()
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float | np.floating):
        number = float(value)
        return number if np.isfinite(number) else None
    if isinstance(value, np.integer):
        return int(value)
    return value
