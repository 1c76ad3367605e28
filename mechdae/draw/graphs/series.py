"""What a path below a task names, as series to draw: values, label, quantity and unit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechdae.draw.graphs.poles import cuts
from mechdae.errors import InputError, UnknownName
from mechdae.records import dataclass
from mechdae.results import KINDS, UNITS, centre_unit, effort_unit, reaction_parts
from mechdae.results.status import UNREACHED
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.results import SweepResult
    from mechdae.results.result import Result
    from mechdae.results.series import Series


Array = NDArray[np.float64]
PRINCIPAL: dict[str, tuple[str, ...]] = {
    "bodies": ("angle",),
    "points": ("position",),
    "joints": ("slide", "s", "angle", "reaction"),
    "drivers": ("position",),
    "outputs": ("value",),
}
"""The series that a path without its last step stands for, the first that is there."""
RATES = {
    "angle": ("angular_velocity", "angular_acceleration"),
    "position": ("velocity", "acceleration"),
    "slide": ("slide_velocity", "slide_acceleration"),
    "s": ("s_velocity", "s_acceleration"),
}
"""The rates of a series in time."""
MOVING = ("bodies", "points", "joints")
BANDS = {"bodies": "angle_band", "joints": "slide_band", "points": "distance_band"}
SIZE = "size"
"""Last step of a path that asks for the length of a vector."""
FREE = {"efforts_uncoupled", "reaction_uncoupled", "loss_uncoupled"}
BEHIND = {"uncoupled": "no friction", "static": "loads", "inertial": "masses"}
SMALL = 1e-12
"""Share of its size below which the change of a series is rounding noise."""


@dataclass(frozen=True)
class Line:
    """One scalar series of a result.

    ``name`` says whose it is, ``quantity`` what it is, ``unit`` is that of the result.
    ``extreme`` is its name in ``summary.extremes``; ``partner`` the path of the series with
    friction that this one without friction stands beside. ``cuts`` are the poses after which
    the vector that it is a component of runs through infinity; ``variant`` is the number of its
    result where several are drawn.
    """

    path: str
    name: str
    quantity: str
    unit: str
    values: Array
    extreme: str = ""
    partner: str = ""
    cuts: tuple[int, ...] = ()
    variant: int = 0

    def at(self, poses: slice) -> Line:
        """Return it at poses that follow each other."""
        values = self.values[poses]
        places = (cut - poses.start for cut in self.cuts)
        return replace(self, values=values, cuts=tuple(c for c in places if 0 <= c < len(values)))


def with_rates(result: Result, path: str) -> list[str]:
    """Return the paths of a series and its rates, as far as they are there, of a part that moves.

    Any other path stands for itself.
    """
    kind, name, *rest = [*path.split("/"), ""]
    table = getattr(result, kind) if kind in MOVING else {}
    if name not in table or rest != [""]:
        return [path]
    series = table[name]
    word = next((principal for principal in PRINCIPAL[kind] if principal in series), "")
    words = (word, *RATES.get(word, ()))
    return [f"{kind}/{name}/{rate}" for rate in words if rate in series] or [path]


def lines_of(result: Result, path: str) -> list[Line]:
    """Return the scalar series a path names: components of vectors one by one.

    Raises
    ------
    UnknownName
        A name that is not in the result, with the nearest.
    """
    head, *rest = result.whole_path(path).split("/")
    if head in KINDS:
        return _of_part(result, path, head, rest)
    if head.startswith("efforts"):
        return _of_efforts(result, path, head, rest)
    if head == "bound":
        units = {"length": "m", "angle": "rad"}
        known = {name: _known("bound", name, result.bound) for name in rest[:1] or result.bound}
        return [_line(path, name, "bound", array, units[name]) for name, array in known.items()]
    if head == "condition" and result.condition is not None:
        return [_line(path, "", "condition", result.condition, "1")]
    if head == "centres" and rest:
        array = _known("pair of bodies", rest[0], result.centres)
        unit, rows = centre_unit(rest[0]), np.reshape(array, (len(array), -1)).T
        axes = (" x", " y", " z") if len(rows) > 1 else ("",)
        names, far = [rest[0] + axis for axis in axes], tuple(cuts(array))
        lines = [
            _line(path, name, "centre", row, unit) for name, row in zip(names, rows, strict=False)
        ]
        return [replace(line, cuts=far) for line in lines]
    if head in result.scalars:
        return [_line(path, "", head, result.scalars[head], UNITS[head])]
    if head == "work" and result.work:
        loads = rest[:1] or list(result.work)
        works = [(load, _known("load", load, result.work)) for load in loads]
        return [_line(f"work/{source}", source, "work", array, "J") for source, array in works]
    heads = [*KINDS, "efforts", "bound", "condition", "centres", *result.scalars, "work"]
    parts = [f"{kind}/{name}" for kind in KINDS for name in getattr(result, kind)]
    raise UnknownName("path", path, [*heads, *parts])


def vector_of(result: SweepResult, path: str) -> tuple[str, str, str, Array]:
    """Return name, quantity, unit and (n, 2) values of a vector, nan where no motion comes to.

    A point's name stands for its position.

    Raises
    ------
    InputError
        The path names no vector.
    """
    path = f"points/{path}" if path in result.points else path
    lines = lines_of(result, path)
    if len(lines) < 2 or lines[0].unit != lines[1].unit:
        raise InputError(
            f"'{path}' is no vector in the plane",
            hint="points/P/position, points/P/velocity, joints/J/reaction",
        )
    part = path.split("/")[1]
    values = np.stack([lines[0].values, lines[1].values], axis=1)
    values[np.isin(result.status, UNREACHED)] = np.nan
    return part, lines[0].quantity, lines[0].unit, values


def default_lines(result: Result) -> list[Line]:
    """Return the series that are drawn if none are named.

    Of reactions: efforts, losses, normal forces and sizes of the pin forces. Of a sweep: the
    outputs the problem names, else angles and slides of what is moved last, with their rates
    where all are of one unit. Of a sweep with clearances: the bands.
    """
    bands: list[Line] = []
    for path in band_paths(result):
        for line in lines_of(result, path):
            beside = [band for band in bands if band.unit == line.unit]
            bands += [line] if len(beside) < MOST and not _known_already(line, beside) else []
    if bands:
        return bands
    lines = [line for path in _default_paths(result) for line in lines_of(result, path)]
    lines = [line for line in lines if np.isfinite(line.values).any()]
    if result.kind == "reactions":
        return lines
    moving = [line for line in lines if _moves(line.values)] or lines
    lines = [line for k, line in enumerate(moving) if not _known_already(line, moving[:k])]
    if result.kind != "sweep" or len({line.unit for line in lines}) > 1:
        return lines
    parts = dict.fromkeys(line.path.rpartition("/")[0] for line in lines)
    rates = [rate for k in (1, 2) for part in parts for rate in with_rates(result, part)[k : k + 1]]
    more = [line for rate in rates for line in lines_of(result, rate)]
    return lines + [line for line in more if np.isfinite(line.values).any()]


def band_paths(result: Result) -> list[str]:
    """Return the paths of the bands that clearance gives to angles, slides and points."""
    return [
        f"{kind}/{part}/{word}"
        for kind, word in BANDS.items()
        for part, series in getattr(result, kind).items()
        if word in series
        and (series[word] > SMALL * (1.0 if kind == "bodies" else result.mechanism.scale)).any()
    ]


def _default_paths(result: Result) -> list[str]:
    if result.kind == "reactions":
        return list(_force_paths(result))
    if result.outputs:
        return [f"outputs/{name}" for name in list(result.outputs)[:MOST]]
    driven = set(result.drivers)
    paths = [
        f"bodies/{name}/angle"
        for name, series in result.bodies.items()
        if f"{name}.angle" not in driven and _moves(series.get("angle"))
    ][-MOST:]
    guided = {
        word: [
            f"joints/{name}/{word}"
            for name, series in result.joints.items()
            if f"{name}.{word}" not in driven and _moves(series.get(word))
        ]
        for word in ("slide", "s")
    }
    paths += (guided["slide"] or guided["s"])[-MOST:]
    if not paths:
        moving = [name for name, series in result.points.items() if _moves(series.get("position"))]
        paths = [f"points/{name}/position" for name in moving[-2:]]
    pins = [f"joints/{n}/angle" for n, each in result.joints.items() if _moves(each.get("angle"))]
    return paths or pins or [f"drivers/{name}/position" for name in result.drivers]


MOST = 5
"""Series of one kind that are drawn if none are named."""


def _force_paths(result: Any) -> Iterator[str]:
    yield "efforts"
    for word in result.parts:
        yield f"efforts_{word}"
    forces = []
    for name, series in result.joints.items():
        if "normal" in series:
            forces.append(f"joints/{name}/normal")
        elif "reaction" in series and np.isfinite(series["reaction"]).any():
            forces.append(f"joints/{name}/reaction/{SIZE}")
    yield from forces[:MOST]
    losses = [name for name, series in result.joints.items() if _positive(series.get("loss"))]
    yield from (f"joints/{name}/loss" for name in losses[:MOST])


def _of_part(result: Result, path: str, kind: str, rest: Sequence[str]) -> list[Line]:
    table = getattr(result, kind)
    if not rest:
        raise UnknownName(kind, path, [f"{kind}/{name}" for name in table])
    part, series = rest[0], table[rest[0]]
    word = rest[1] if len(rest) > 1 else ""
    if not word or word == SIZE:
        word = next((name for name in PRINCIPAL[kind] if name in series), "")
    if kind == "bodies" and word in (PRINCIPAL["points"][0], *RATES[PRINCIPAL["points"][0]]):
        points = [f"points/{name}/{word}" for name in result.points if name.startswith(f"{part}.")]
        raise UnknownName("series of a body", path, points)
    array = _known("series", word or rest[-1], series)
    unit = result.unit(kind, part, word)
    quantity, partner = word.replace("_", " "), ""
    if word in FREE:
        quantity = f"{word.removesuffix('_uncoupled')}, no friction"
        partner = path.replace(word, word.removesuffix("_uncoupled"))
    if kind == "drivers":
        # a position is what the coordinate is: angle, slide, s, x, y
        quantity = part.rpartition(".")[2] + ("" if word == "position" else f" {word}")
        part = part.rpartition(".")[0]
    elif kind == "outputs":
        quantity = "" if word == "value" else word
    if array.ndim == 1:
        extreme = f"{part}.{word}" if kind in ("bodies", "joints") else ""
        return [_line(path, part, quantity, array, unit, extreme, partner)]
    axes: tuple[str, ...] = ("x", "y", "z")
    units: tuple[str, ...] = (unit,) * 3
    if word.startswith("reaction"):
        axes, units = reaction_parts(word, array.shape[1])
    if rest[-1] == SIZE:
        plane = array.shape[1] == 2 or (word.startswith("reaction") and array.shape[1] == 3)
        values = np.linalg.norm(array[:, : 2 if plane else 3], axis=1)
        return [_line(path, f"|{part}|", quantity, values, units[0], "", partner)]
    rows = dict(zip(axes, zip(array.T, units, strict=False), strict=False))
    chosen = rest[2:3] or list(rows)
    if not set(chosen) <= set(rows):
        raise UnknownName("component", rest[2], [*rows, SIZE])
    far = tuple(cuts(array)) if word.startswith("centrode") else ()
    lines = []
    for axis in chosen:
        extreme = f"{part}.{axis}" if word == "position" else ""
        line = _line(path, f"{part} {axis}", quantity, *rows[axis], extreme, partner)
        lines.append(replace(line, cuts=far))
    return lines


def _of_efforts(result: Any, path: str, head: str, rest: Sequence[str]) -> list[Line]:
    word = head.removeprefix("efforts").lstrip("_")
    if word and word not in result.parts:
        raise UnknownName("path", path, ["efforts", *(f"efforts_{part}" for part in result.parts)])
    series = result.parts[word] if word else result.efforts
    names = rest[:1] or list(series)
    lines = []
    for name in names:
        unit = effort_unit(result.mechanism, name)
        title = f"{name}, {BEHIND.get(word, word)}" if word else name
        partner = f"efforts/{name}" if word == "uncoupled" else ""
        values = _known("driver", name, series)
        lines.append(_line(f"{head}/{name}", title, "effort", values, unit, "", partner))
    return lines


def _line(
    path: str, name: str, quantity: str, values: Floats, unit: str, extreme: str = "",
    partner: str = "",
) -> Line:  # fmt: skip
    return Line(path, name, quantity, unit, np.asarray(values, float), extreme, partner)


def _known(kind: str, name: str, table: Series) -> Any:
    if name not in table:
        raise UnknownName(kind, name, list(table))
    return table[name]


def _known_already(line: Line, others: Sequence[Line]) -> bool:
    """Return whether a curve would lie on another one, such as that of a block on its rod."""
    return any(
        other.unit == line.unit
        and np.allclose(other.values, line.values, rtol=1e-9, atol=0.0, equal_nan=True)
        for other in others
    )


def noise_of(result: Result, unit: str) -> float:
    """Return what is rounding noise beside a turn or the size of the mechanism, in a unit.

    Rates are compared with those of the drivers: 0 where these have none.
    """
    size, _, per = unit.partition("/")
    if size not in ("rad", "m"):
        return 0.0
    order = {"": 0, "s": 1, "s2": 2}.get(per, 3)
    scale = {"rad": 1.0, "m": float(result.mechanism.scale)}
    pace = 0.0
    for name, driver in result.drivers.items() if order else ():
        speed = getattr(driver, "velocity", None)
        over = scale[result.unit("drivers", name, "position")]
        pace = max(pace, float(np.nanmax(np.abs(speed))) / over) if speed is not None else pace
    return scale[size] * pace**order * 10.0 ** (2 * order - 13)


def _moves(values: Floats | None) -> bool:
    if values is None:
        return False
    rows = np.reshape(values, (len(values), -1))
    rows = rows[np.isfinite(rows).all(axis=1)]
    size = np.abs(rows).max(initial=0.0)
    return bool(len(rows) > 1 and np.ptp(rows, axis=0).max() > SMALL * size)


def _positive(values: Floats | None) -> bool:
    return values is not None and bool((values[np.isfinite(values)] > 0).any())
