"""Units by the names that people ask for: those of tables, CSV, pictures, pages; JSON stays SI."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from types import MappingProxyType

from mechdae.describe.units import TABLE, ShownUnit, Units, nearest_suffixes
from mechdae.errors import InputError, UnknownName

POWERS: Mapping[str, Mapping[str, tuple[int, str]]] = {
    "m": {"m": (1, "{}"), "m/s": (1, "{}/s"), "m/s2": (1, "{}/s2"), "m/s3": (1, "{}/s3"),
          "m2": (2, "{}2"), "1/m": (-1, "1/{}")},
    "rad": {"rad": (1, "{}"), "rad/s": (1, "{}/s"), "rad/s2": (1, "{}/s2"),
            "rad/s3": (1, "{}/s3")},
    "rad/s": {"rad/s": (1, "{}")},
    "N": {"N": (1, "{}")},
    "N m": {"N m": (1, "{}")},
    "kg": {"kg": (1, "{}")},
    "kg m2": {"kg m2": (1, "{}")},
}  # fmt: skip
"""Quantity, by its unit in SI -> units that follow it: its power in them, how they are written."""
QUANTITIES = {
    "m": "lengths", "rad": "angles", "rad/s": "angular speeds", "N": "forces", "N m": "moments",
    "kg": "masses", "kg m2": "moments of inertia",
}  # fmt: skip


def _known() -> dict[str, tuple[str, str, Fraction, bool]]:
    """Return what units may be called -> (quantity, name, size in SI, whether times pi)."""
    known = {si: (si, si, Fraction(1), False) for si in POWERS}
    for unit in TABLE:
        quantity = unit.si[0]
        known.setdefault(unit.name, (quantity, unit.name, unit.size, unit.pi))
    spelled = {name.replace(" ", "_").replace("/", "_"): unit for name, unit in known.items()}
    suffixed = {unit.suffix[1:]: known[unit.name] for unit in TABLE}
    return {**spelled, **suffixed, **known}


KNOWN = _known()
NAMES = tuple(dict.fromkeys(name for _, name, _, _ in KNOWN.values()))
"""How units are written, SI and others."""


def units_of(text: str | Sequence[str]) -> Units:
    """Return the units that a text names: ``mm,deg,kN``.

    Lengths give the units of their rates, of areas and curvatures, angles those of their rates
    unless angular speeds have one of their own (``deg,rpm``).

    Raises
    ------
    UnknownName
        No unit, with the nearest.
    InputError
        Two units of one quantity, or none at all.
    """
    words = [name.strip() for name in (text.split(",") if isinstance(text, str) else text)]
    chosen: dict[str, tuple[str, Fraction, bool]] = {}
    for word in words:
        if word not in KNOWN:
            raise _unknown(word)
        quantity, name, size, pi = KNOWN[word]
        if quantity in chosen and chosen[quantity][0] != name:
            raise InputError(
                f"{chosen[quantity][0]} and {name} are both units of {QUANTITIES[quantity]}",
                where="units",
                hint="one for each quantity",
            )
        chosen[quantity] = name, size, pi
    by_si: dict[str, ShownUnit] = {}
    for quantity in POWERS:  # angles before angular speeds
        if quantity in chosen:
            name, size, pi = chosen[quantity]
            for si, (power, written) in POWERS[quantity].items():
                factor = float(1 / size**power) / (math.pi if pi else 1.0)
                by_si[si] = ShownUnit(written.format(name), factor)
    return Units(tuple(words), MappingProxyType(by_si))


def _unknown(word: str) -> UnknownName:
    error = UnknownName("unit", word, NAMES, where="units")
    meant = [suffix[1:] for suffix in nearest_suffixes(word)] if word else []
    names = list(dict.fromkeys(KNOWN[name][1] for name in meant if name in KNOWN))
    known = f"units are {', '.join(NAMES)}"
    error.hint = f"did you mean {' or '.join(names)}? {known}" if names else known
    return error
