"""Mechanisms by their lengths: templates with numbers of one's own, sketched and driven."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from typing import TYPE_CHECKING

from mechdae.describe.dimensions import parameter_units
from mechdae.describe.file import library
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem
from mechdae.describe.file.reading import split_known
from mechdae.describe.units import EVERY, KNOWN, units_of
from mechdae.errors import InputError, UnknownName
from mechdae.parts.models.sketching import sketched_at

if TYPE_CHECKING:
    from mechdae.types import Json

SIGNED = ("offset", "ex", "ey", "fx", "fy", "gx", "gy", "hx", "hy", "px", "py", "F",
          "crank_offset", "rocker_offset")  # fmt: skip
"""Parameters of the templates that may be zero or negative, beside angles and speeds."""


def four_bar(
    ground: float, crank: float, coupler: float, rocker: float, *, units: str = "m", **more: float
) -> Problem:
    """Return a four-bar linkage, its crank driven over all angles at which it assembles.

    Parameters
    ----------
    ground, crank, coupler, rocker
        Lengths AD, AB, BC, DC.
    units
        Units of all numbers of the call: ``"mm,deg"``.
    more
        Other parameters of the file that ``md.new("four-bar")`` shows: ``px``, ``py`` of the
        coupler point P, ``omega``.

    Returns
    -------
    Problem
        Bodies crank, coupler, rocker; joints A, B, C, D.

    Raises
    ------
    InputError
        Lengths that assemble at no angle of the crank: the message has the bound of one; units
        that are mixed.

    Examples
    --------
    >>> problem = md.four_bar(100, 40, 120, 80, units="mm,deg")
    >>> result = md.solve(problem, poses=5)
    >>> round(result.value("summary/swing/rocker"), 4)
    1.2877
    """
    sizes = {"ground": ground, "crank": crank, "coupler": coupler, "rocker": rocker}
    return _model("four-bar", units, sizes, more)


def slider_crank(
    crank: float, rod: float, offset: float = 0.0, *, units: str = "m", **more: float
) -> Problem:
    """Return a slider-crank, its crank driven over all angles at which it assembles.

    Parameters
    ----------
    crank, rod
        Lengths OB, BC.
    offset
        Distance of the guide from O, to the left of its sense.
    units, more
        As of `four_bar`.

    Returns
    -------
    Problem
        Bodies crank, rod, slider; its guide lies along x.

    Raises
    ------
    InputError
        As of `four_bar`.

    Examples
    --------
    >>> result = md.solve(md.slider_crank(0.1, 0.3), poses=5)
    >>> round(result.value("summary/stroke/guide"), 4)
    0.2
    """
    return _model("slider-crank", units, {"crank": crank, "rod": rod, "offset": offset}, more)


def inverted_slider_crank(
    ground: float, crank: float, *, units: str = "m", **more: float
) -> Problem:
    """Return a crank whose pin slides in a link that swings, or turns where ``crank > ground``.

    Parameters
    ----------
    ground, crank
        Distance of the two pivots, length of the crank.
    units, more
        As of `four_bar`.

    Returns
    -------
    Problem
        With the driven crank.

    Raises
    ------
    InputError
        As of `four_bar`.

    Examples
    --------
    >>> result = md.solve(md.inverted_slider_crank(0.2, 0.1), poses=5)
    >>> {name: round(float(swing), 4) for name, swing in result.summary["swing"].items()}
    {'crank': 6.2832, 'link': 1.0472}
    """
    return _model("quick-return", units, {"ground": ground, "crank": crank}, more)


def five_bar(
    ground: float, left: float, left_rod: float, right_rod: float, right: float, *,
    units: str = "m", **more: float,
) -> Problem:  # fmt: skip
    """Return a five-bar linkage, two cranks that place a point, at one pose.

    Parameters
    ----------
    ground, left, left_rod, right_rod, right
        Lengths AE, AB, BP, DP, ED; the rods meet in P.
    units, more
        As of `four_bar`, also ``left_angle`` and ``right_angle`` of the pose.

    Returns
    -------
    Problem
        With both cranks driven.

    Raises
    ------
    InputError
        As of `four_bar`.

    Examples
    --------
    >>> problem = md.five_bar(0.1, 0.06, 0.1, 0.1, 0.06, left_angle=2.0, right_angle=1.0)
    >>> md.solve(problem).status.tolist()
    ['ok']
    """
    sizes = {"ground": ground, "left": left, "left_rod": left_rod}
    return _model("five-bar", units, sizes | {"right_rod": right_rod, "right": right}, more)


def watt(
    ground: float, crank: float, coupler: float, rocker: float, ex: float, ey: float, fx: float,
    fy: float, link: float, arm: float, *, units: str = "m", **more: float,
) -> Problem:  # fmt: skip
    """Return Watt's six-bar: a four-bar, and EG and FG between its coupler and its rocker.

    Parameters
    ----------
    ground, crank, coupler, rocker
        Lengths of the four-bar ABCD, as of `four_bar`.
    ex, ey
        E in the coupler, from B along BC.
    fx, fy
        F in the rocker, from D along DC.
    link, arm
        Lengths EG, FG.
    units, more
        As of `four_bar`.

    Returns
    -------
    Problem
        With the driven crank.

    Raises
    ------
    InputError
        As of `four_bar`.

    Examples
    --------
    >>> problem = md.watt(0.1, 0.04, 0.12, 0.08, 0.06, 0.05, 0.05, -0.03, 0.1, 0.09)
    >>> len(md.solve(problem, poses=5))
    5
    """
    sizes = {"ground": ground, "crank": crank, "coupler": coupler, "rocker": rocker}
    dyad = {"ex": ex, "ey": ey, "fx": fx, "fy": fy, "link": link, "arm": arm}
    return _model("watt", units, sizes | dyad, more)


def stephenson(
    ground: float, crank: float, coupler: float, rocker: float, ex: float, ey: float, gx: float,
    gy: float, link: float, lever: float, *, units: str = "m", **more: float,
) -> Problem:  # fmt: skip
    """Return Stephenson's six-bar: a four-bar, and EF and GF between its coupler and the ground.

    Parameters
    ----------
    ground, crank, coupler, rocker
        Lengths of the four-bar ABCD, as of `four_bar`.
    ex, ey
        E in the coupler, from B along BC.
    gx, gy
        The fixed pin G, from A along AD.
    link, lever
        Lengths EF, GF.
    units, more
        As of `four_bar`.

    Returns
    -------
    Problem
        With the driven crank.

    Raises
    ------
    InputError
        As of `four_bar`.

    Examples
    --------
    >>> problem = md.stephenson(0.1, 0.04, 0.12, 0.08, 0.06, 0.05, 0.2, 0.05, 0.15, 0.1)
    >>> len(md.solve(problem, poses=5))
    5
    """
    sizes = {"ground": ground, "crank": crank, "coupler": coupler, "rocker": rocker}
    dyad = {"ex": ex, "ey": ey, "gx": gx, "gy": gy, "link": link, "lever": lever}
    return _model("stephenson", units, sizes | dyad, more)


def rssr(
    ground: float, crank: float, coupler: float, rocker: float, twist: float = math.pi / 2, *,
    units: str = "m", **more: float,
) -> Problem:  # fmt: skip
    """Return a spatial four-bar: crank and rocker about two axes, a bar with balls between them.

    Parameters
    ----------
    ground
        Distance of the axes along their common normal.
    crank, coupler, rocker
        Lengths of the crank, the bar and the rocker.
    twist
        Angle between the axes, a right angle where it is not given [rad].
    units, more
        As of `four_bar`, also ``crank_offset`` and ``rocker_offset`` along the axes.

    Returns
    -------
    Problem
        In space, with the driven crank.

    Raises
    ------
    InputError
        As of `four_bar`.

    Examples
    --------
    >>> result = md.solve(md.rssr(1.0, 0.3, 1.1, 0.8), poses=5)
    >>> result.status.tolist()
    ['ok', 'ok', 'ok', 'ok', 'ok']
    """
    sizes = {"ground": ground, "crank": crank, "coupler": coupler, "rocker": rocker}
    return _model("rssr", units, sizes, ({} if twist == math.pi / 2 else {"twist": twist}) | more)


def cylinder(
    hx: float, hy: float, lever: float, closed: float, opened: float, *, units: str = "m",
    **more: float,
) -> Problem:  # fmt: skip
    """Return a cylinder from H to a lever's A, driven from its shut to its open length.

    Parameters
    ----------
    hx, hy
        H, from the lever's pin O.
    lever
        Length OA.
    closed, opened
        Shortest and longest length HA.
    units, more
        As of `four_bar`. With ``bore``, or a load ``F`` at the distance ``reach``, the first task
        gives forces: ``needed`` is the pressure [Pa] that they take, ``share`` its share of
        ``pressure``.

    Returns
    -------
    Problem
        With the driven cylinder.

    Raises
    ------
    InputError
        Lengths between which the lever cannot swing.

    Examples
    --------
    >>> problem = md.cylinder(600, -200, 400, 500, 800, units="mm,deg")
    >>> md.solve(problem, poses=3).status.tolist()
    ['ok', 'ok', 'ok']
    """
    sizes = {"hx": hx, "hy": hy, "lever": lever, "closed": closed, "opened": opened}
    apart = math.hypot(hx, hy)
    if not abs(apart - lever) < closed < opened < apart + lever:
        raise InputError(
            f"a cylinder of {closed:g} to {opened:g} does not fit",
            where="cylinder",
            hint=f"closed above {abs(apart - lever):.6g}, opened above it and below "
            f"{apart + lever:.6g}, the least and the greatest distance of H and A",
        )
    first = "forces" if {split_known(name, ("bore", "F", "reach"))[0] for name in more} else ""
    return _model("cylinder", units, sizes, more, first)


def _model(
    template: str,
    units: str,
    sizes: Mapping[str, float],
    more: Mapping[str, float],
    first: str = "",
) -> Problem:
    """Return a template with the numbers given in `units`, sketched where it assembles."""
    data: Json = tomllib.loads(library.new(template))
    usual = from_dict(data, template)
    si = parameter_units(usual.mechanism, usual.tasks.values())
    typed = {**data["parameters"]}
    for key in typed:  # a suffix in the template tells too
        base, suffix = split_known(key, usual.mechanism.parameters)
        si.setdefault(base, EVERY[suffix].si[0] if suffix else "1")
    where, given = template.replace("-", "_"), dict[str, tuple[str, float]]()
    for name, value in {**sizes, **more}.items():
        base, suffix = split_known(name, usual.mechanism.parameters)
        if base not in usual.mechanism.parameters:
            raise UnknownName("parameter", base, usual.mechanism.parameters, where=where)
        meant = _suffix(units, si[base])
        if suffix and meant and suffix != meant and EVERY[suffix].si[0] == EVERY[meant].si[0]:
            raise InputError(
                f"{EVERY[meant].of} in two units in one call: {name}, and units = {units!r}",
                where=where,
                hint=f"{base} = ... in {EVERY[meant].name}, like all others",
            )
        _check(value, base, where, si[base])
        key = next(key for key in typed if split_known(key, (base,))[0] == base)
        given[key] = (base + (suffix or meant), value)
    data["parameters"] = dict(given.get(entry[0], entry) for entry in typed.items())
    if first:
        data["tasks"] = {first: data["tasks"][first], **data["tasks"]}
    return sketched_at(data, usual, units)


def _suffix(units: str, si: str) -> str:
    """Return how a key ends whose number is in one of the units, "" for SI or none of them."""
    found = ""
    for word in units_of(units).asked:
        for unit in EVERY.values():
            if unit.name == KNOWN[word][1] and si in unit.si:
                found = unit.suffix if not found or unit.si[0] == si else found
    return found


def _check(value: object, name: str, where: str, unit: str) -> None:
    """Raise for what is no number, and for a length that is none."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"a number is needed, not {value!r}", where=f"{where}: {name}")
    if unit == "m" and value <= 0 and name not in SIGNED:
        raise InputError(f"a length above 0 is needed, not {value:g}", where=f"{where}: {name}")
