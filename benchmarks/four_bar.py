"""The four-bar of the yardstick by other means: a closed form in C, pylinkage, scipy's fsolve.

Each is left out where it cannot be had: C without a compiler (``cc``), the others where they are
not installed. Errors are those of the angles of coupler and rocker against the closed form in
80-bit floats.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.written import c_library
from mechdae.kernels.run.high_precision import LONG
from mechdae.parts.bench.kinematics import COMPARED, Other
from mechdae.parts.bench.runs import COUPLER, CRANK, GROUND, ROCKER, yardstick

LENGTHS = (CRANK, COUPLER, ROCKER, GROUND)
SOURCE = Path(__file__).with_name("fourbar.c")
PLAIN = 1_000
"""Poses up to which pylinkage without numba is measured."""


def others(s: Any) -> Iterator[Other]:
    """Yield the other means to the poses of a turn of the crank at `s` (n,)."""
    crank = np.ascontiguousarray(s, float)
    yield from closed_form(crank)
    yield from pylinkage(crank)
    if len(crank) <= COMPARED:
        yield from fsolve(crank)


def off(angles: Any, crank: Any) -> float:
    """Return the largest error of the angles (2, n) of coupler and rocker at a crank's (n,)."""
    truth = np.array(yardstick(np.asarray(crank, LONG))[:2])
    gap = np.asarray(angles, LONG) - truth
    turn = 2 * np.arctan2(LONG(0), LONG(-1))
    return float(np.abs(gap - turn * np.round(gap / turn)).max())


@cache
def compiled() -> Any:
    """Return the function in C, None without a compiler."""
    library = c_library(SOURCE)
    if library is None:
        return None
    function = library.fourbar
    pointer = np.ctypeslib.ndpointer(float, flags="C_CONTIGUOUS")
    function.argtypes, function.restype = [ctypes.c_long, pointer, pointer, pointer], None
    return function


def closed_form(crank: Any) -> Iterator[Other]:
    """Yield the closed form in C, angles with two derivatives each."""
    function = compiled()
    if function is None:
        return
    lengths = np.array(LENGTHS)

    def way() -> Any:
        out = np.empty((6, len(crank)))
        function(len(crank), crank, lengths, out)
        return out

    yield Other("closed form in C", "angles and rates", way, lambda out: off(out[:2], crank))


def pylinkage(crank: Any) -> Iterator[Other]:
    """Yield pylinkage with velocities and accelerations, positions only, and without numba."""
    try:
        from pylinkage.actuators import Crank
        from pylinkage.components import Ground
        from pylinkage.dyads import RRRDyad
        from pylinkage.simulation import Linkage
    except ImportError:
        return
    n = len(crank)
    step = float(crank[1] - crank[0]) if n > 1 else 0.1
    start = float(crank[0]) - step  # each step turns the crank first

    def linkage() -> Any:
        A, D = Ground(0.0, 0.0, name="A"), Ground(GROUND, 0.0, name="D")
        B = Crank(anchor=A, radius=CRANK, angular_velocity=step, initial_angle=start, name="B")
        C = RRRDyad(B.output, D, distance1=COUPLER, distance2=ROCKER, name="C")
        t3 = float(yardstick(np.array([start]))[0][0])
        C.x = CRANK * np.cos(start) + COUPLER * np.cos(t3)
        C.y = CRANK * np.sin(start) + COUPLER * np.sin(t3)
        made = Linkage([A, D, B, C], name="four-bar")
        made.set_input_velocity(B, 1.0)
        return made

    own = linkage()
    first = own.get_coords()

    def again() -> Any:
        own.set_coords(first)
        return own

    def error(places: Any) -> float:
        places = np.asarray(places, float).reshape(-1, 4, 2)
        B, C = places[:n, 2], places[:n, 3]
        coupler, rocker = C - B, C - np.array([GROUND, 0.0])
        angles = [np.arctan2(v[:, 1], v[:, 0]) for v in (coupler, rocker)]
        return off(angles, crank)

    try:
        import numba  # noqa: F401
    except ImportError:
        setting = "without numba"
    else:
        setting = "numba"
    if setting == "numba" or n <= PLAIN:
        yield Other(
            "pylinkage", f"{setting}, with rates",
            lambda: again().step_fast_with_kinematics(n), lambda found: error(found[0]),
        )  # fmt: skip
        yield Other("pylinkage", f"{setting}, positions", lambda: again().step_fast(n), error)


def fsolve(crank: Any) -> Iterator[Other]:
    """Yield scipy's fsolve from pose to pose, its Jacobian given, positions only."""
    try:
        from scipy.optimize import fsolve as solved
    except ImportError:
        return
    a, b, c, d = LENGTHS
    start = np.array([part[0] for part in yardstick(crank[:1])[:2]])

    def way() -> Any:
        rows, x = np.empty((len(crank), 2)), start
        for k, (u, v) in enumerate(zip(a * np.cos(crank), a * np.sin(crank), strict=True)):
            rows[k] = x = solved(_gap, x, args=(u - d, v, b, c), fprime=_slope, xtol=1e-12)
        return rows.T

    yield Other("scipy fsolve", "positions", way, lambda angles: off(angles, crank))


def _gap(x: Any, u: float, v: float, b: float, c: float) -> Any:
    sine, cosine = np.sin(x), np.cos(x)
    return [u + b * cosine[0] - c * cosine[1], v + b * sine[0] - c * sine[1]]


def _slope(x: Any, u: float, v: float, b: float, c: float) -> Any:
    sine, cosine = np.sin(x), np.cos(x)
    return [[-b * sine[0], c * sine[1]], [b * cosine[0], -c * cosine[1]]]
