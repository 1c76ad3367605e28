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

    Raises
    ------
    InputError
        Lengths that assemble at no angle of the crank: the message has the bound of one; units
        that are mixed.

    Examples
    --------
    >>> result = md.solve(md.four_bar(100, 40, 120, 80, units="mm,deg"))
    """
    sizes = {"ground": ground, "crank": crank, "coupler": coupler, "rocker": rocker}
    return _model("four-bar", units, sizes, more)


def slider_crank(
    crank: float, rod: float, offset: float = 0.0, *, units: str = "m", **more: float
) -> Problem:
    """Return a slider-crank, its crank driven over all angles at which it assembles.

    ``crank`` is OB, ``rod`` BC, ``offset`` that of the guide from O; the rest is as for
    `four_bar`.
    """
    return _model("slider-crank", units, {"crank": crank, "rod": rod, "offset": offset}, more)


def inverted_slider_crank(
    ground: float, crank: float, *, units: str = "m", **more: float
) -> Problem:
    """Return a crank whose pin slides in a link that swings, or turns where ``crank > ground``.

    ``ground`` is the distance of the two pivots; the rest is as for `four_bar`.
    """
    return _model("quick-return", units, {"ground": ground, "crank": crank}, more)


def five_bar(
    ground: float, left: float, left_rod: float, right_rod: float, right: float, *,
    units: str = "m", **more: float,
) -> Problem:  # fmt: skip
    """Return a five-bar linkage, two cranks that place a point, at one pose.

    ``left`` and ``right`` are the cranks AB and ED, the rods meet in P; ``left_angle`` and
    ``right_angle`` may be given too. The rest is as for `four_bar`.
    """
    sizes = {"ground": ground, "left": left, "left_rod": left_rod}
    return _model("five-bar", units, sizes | {"right_rod": right_rod, "right": right}, more)


def watt(
    ground: float, crank: float, coupler: float, rocker: float, ex: float, ey: float, fx: float,
    fy: float, link: float, arm: float, *, units: str = "m", **more: float,
) -> Problem:  # fmt: skip
    """Return Watt's six-bar: a four-bar, and EG and FG between its coupler and its rocker.

    E is at ``(ex, ey)`` in the coupler, from B along BC, F at ``(fx, fy)`` in the rocker, from D
    along DC; ``link`` is EG, ``arm`` FG. The rest is as for `four_bar`.
    """
    sizes = {"ground": ground, "crank": crank, "coupler": coupler, "rocker": rocker}
    dyad = {"ex": ex, "ey": ey, "fx": fx, "fy": fy, "link": link, "arm": arm}
    return _model("watt", units, sizes | dyad, more)


def stephenson(
    ground: float, crank: float, coupler: float, rocker: float, ex: float, ey: float, gx: float,
    gy: float, link: float, lever: float, *, units: str = "m", **more: float,
) -> Problem:  # fmt: skip
    """Return Stephenson's six-bar: a four-bar, and EF and GF between its coupler and the ground.

    E is at ``(ex, ey)`` in the coupler, from B along BC, the fixed pin G at ``(gx, gy)`` from A
    along AD; ``link`` is EF, ``lever`` GF. The rest is as for `four_bar`.
    """
    sizes = {"ground": ground, "crank": crank, "coupler": coupler, "rocker": rocker}
    dyad = {"ex": ex, "ey": ey, "gx": gx, "gy": gy, "link": link, "lever": lever}
    return _model("stephenson", units, sizes | dyad, more)


def rssr(
    ground: float, crank: float, coupler: float, rocker: float, twist: float = math.pi / 2, *,
    units: str = "m", **more: float,
) -> Problem:  # fmt: skip
    """Return a spatial four-bar: crank and rocker about two axes, a bar with balls between them.

    ``ground`` is the distance of the axes along their common normal, ``twist`` the angle between
    them; ``crank_offset`` and ``rocker_offset`` along the axes may be given too. The rest is as
    for `four_bar`.
    """
    sizes = {"ground": ground, "crank": crank, "coupler": coupler, "rocker": rocker}
    return _model("rssr", units, sizes, ({} if twist == math.pi / 2 else {"twist": twist}) | more)


def cylinder(
    hx: float, hy: float, lever: float, closed: float, opened: float, *, units: str = "m",
    **more: float,
) -> Problem:  # fmt: skip
    """Return a cylinder from H to a lever's A, driven from its shut to its open length.

    ``(hx, hy)`` is H from the lever's pin O, ``lever`` OA. With ``bore`` or a load ``F`` at the
    distance ``reach`` its first task gives forces: ``needed`` is the pressure [Pa] that they take,
    ``share`` that of the ``pressure`` there is. The rest is as for `four_bar`.
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
