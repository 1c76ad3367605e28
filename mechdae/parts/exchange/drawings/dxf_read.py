"""DXF: what a sketch needs of a file that is read.

ASCII files of any release; places are returned in metres. What is not read is counted by its name.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from mechdae.errors import InputError, ProblemFileError
from mechdae.types import Floats

Place = Sequence[float] | Floats
"""x and y."""
UNDRAWN = "not drawn: "
"""Begin of the comment that names joints without a line."""
SAME = 1e-9
"""Share of the extent by which ends of a polyline that is closed may be apart."""


def distance(point: Place, start: Place, end: Place) -> float:
    """Return the distance of a point from a stretch of a line."""
    wx, wy = end[0] - start[0], end[1] - start[1]
    px, py = point[0] - start[0], point[1] - start[1]
    long = wx * wx + wy * wy
    share = min(max((wx * px + wy * py) / long, 0.0), 1.0) if long else 0.0
    return math.hypot(px - share * wx, py - share * wy)


UNITS = {1: 0.0254, 2: 0.3048, 4: 1e-3, 5: 1e-2, 6: 1.0, 10: 0.9144, 14: 0.1}
"""Metres by the values of $INSUNITS."""
NAMED = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "ft": 0.3048}
COMMENT = 999
MOST_BYTES = 50_000_000
Pairs = list[tuple[int, str]]
Spot = tuple[float, float]


@dataclass(frozen=True)
class DrawnCircle:
    """A circle, or a point as one of radius 0."""

    layer: str
    center: Spot
    radius: float


@dataclass(frozen=True)
class DrawnLine:
    """A line or polyline through its corners; a closed one ends where it begins."""

    layer: str
    corners: tuple[Spot, ...]


@dataclass
class DrawnSketch:
    """The lines and circles of a drawing [m]; ``skipped`` counts what else is in it.

    ``unit`` is the length of a unit of the drawing [m], ``layers`` are those of all entities,
    ``undrawn`` are comments of a drawing of mechdae's on what has no line.
    """

    unit: float = 1e-3
    lines: list[DrawnLine] = field(default_factory=list)
    circles: list[DrawnCircle] = field(default_factory=list)
    skipped: Counter[str] = field(default_factory=Counter)
    layers: set[str] = field(default_factory=set)
    undrawn: list[str] = field(default_factory=list)


def read_drawing(path: str | Path, unit: str | None = None) -> DrawnSketch:
    """Return the sketch in a DXF file.

    `unit`: "mm", "cm", "m", "in" or "ft", in place of the file's own; millimetres where it names
    none.
    """
    target = Path(path)
    if unit is not None and unit not in NAMED:
        raise InputError(f"unknown unit '{unit}'", where="--units", hint=", ".join(NAMED))
    pairs = _pairs(target)
    factor = NAMED[unit] if unit else UNITS.get(_units(pairs), 1e-3)
    undrawn = [text for code, text in pairs if code == COMMENT and text.startswith(UNDRAWN)]
    found = DrawnSketch(factor, undrawn=undrawn)
    try:
        _entities(pairs, found, factor)
    except (ValueError, KeyError):
        raise ProblemFileError("an entity without its numbers", where=str(path)) from None
    return found


def _pairs(path: Path) -> Pairs:
    """Return group codes with their values."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise ProblemFileError("more than 50 MB", where=str(path))
        content = path.read_bytes()
    except OSError as error:
        raise ProblemFileError(
            f"cannot be read: {error.strerror or error}", where=str(path)
        ) from None
    if content.startswith(b"AutoCAD Binary DXF"):
        raise ProblemFileError(
            "a binary DXF file", where=str(path), hint="save it as ASCII DXF, release 12 or later"
        )
    lines = content.decode("utf-8", "replace").splitlines()
    found: Pairs = []
    for k in range(0, len(lines) - 1, 2):
        code = lines[k].strip()
        if not code.lstrip("-").isdigit():
            raise ProblemFileError(
                f"line {k + 1} is no group code: '{code[:20]}'",
                where=str(path),
                hint="an ASCII DXF file is read",
            )
        found.append((int(code), lines[k + 1].strip()))
    if (0, "SECTION") not in found:
        raise ProblemFileError("no section of a DXF file", where=str(path))
    return found


def _units(pairs: Pairs) -> int:
    """Return $INSUNITS, 0 without one."""
    for (code, value), (_, following) in itertools.pairwise(pairs):
        if code == 9 and value == "$INSUNITS" and following.lstrip("-").isdigit():
            return int(following)
    return 0


def _sections(pairs: Pairs) -> Iterator[tuple[str, Pairs]]:
    """Yield the entities of the drawing: name and pairs of each."""
    inside, name, entity = False, "", Pairs()
    for k, (code, value) in enumerate(pairs):
        if code == 0:
            if inside and name not in ("SECTION", ""):
                yield name, entity
            if value == "ENDSEC":
                inside = False
            name, entity = value, []
        elif code == 2 and name == "SECTION" and k and pairs[k - 1] == (0, "SECTION"):
            inside = value == "ENTITIES"
            name = "SECTION"
        else:
            entity.append((code, value))


def _entities(pairs: Pairs, found: DrawnSketch, factor: float) -> None:
    open_line: tuple[str, bool, list[Spot]] | None = None
    for name, entity in _sections(pairs):
        given = dict(reversed(entity))
        layer = given.get(8, "0").upper()

        def spot(x: int, values: dict[int, str] = given) -> Spot:
            return _number(values[x]) * factor, _number(values[x + 10]) * factor

        if name == "POLYLINE":
            open_line = (layer, bool(int(given.get(70, "0")) & 1), [])
        elif name == "VERTEX" and open_line is not None:
            open_line[2].append(spot(10))
        elif name == "SEQEND" and open_line is not None:
            _put_line(found, *open_line)
            open_line = None
        elif name == "LINE":
            _put_line(found, layer, False, [spot(10), spot(11)])
        elif name == "LWPOLYLINE":
            xs = [_number(value) * factor for code, value in entity if code == 10]
            ys = [_number(value) * factor for code, value in entity if code == 20]
            closed = bool(int(given.get(70, "0")) & 1)
            _put_line(found, layer, closed, list(zip(xs, ys, strict=True)))
        elif name == "CIRCLE":
            found.circles.append(DrawnCircle(layer, spot(10), abs(_number(given[40])) * factor))
        elif name == "POINT":
            found.circles.append(DrawnCircle(layer, spot(10), 0.0))
        elif name not in ("SECTION", "ENDSEC", "EOF"):
            found.skipped[f"{name} on layer {layer}" if layer != "0" else name] += 1
        if name not in ("SECTION", "ENDSEC", "EOF"):
            found.layers.add(layer)


def _number(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError
    return value


def _put_line(found: DrawnSketch, layer: str, closed: bool, corners: list[Spot]) -> None:
    distinct = [corner for k, corner in enumerate(corners) if not k or corner != corners[k - 1]]
    if closed and len(distinct) > 2 and distinct[0] != distinct[-1]:
        distinct.append(distinct[0])
    if len(distinct) > 1:
        found.lines.append(DrawnLine(layer, tuple(distinct)))
