"""Units in one table, those of problem files and of what is written out; what units are made of.

SI inside, these outside.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from functools import cache
from types import MappingProxyType

from mechdae.errors import InputError, MechdaeError, UnknownName, nearest
from mechdae.records import dataclass

Powers = tuple[Fraction, ...]
"""Exponents of metre, radian, second and kilogram."""
BASES = ("m", "rad", "s", "kg")
NAMED = {
    "N": (1, 0, -2, 1),
    "N m": (2, 0, -2, 1),
    "N/m": (0, 0, -2, 1),
    "N m/rad": (2, -1, -2, 1),
    "N s/m": (0, 0, -1, 1),
    "N m s/rad": (2, -1, -1, 1),
    "W": (2, 0, -3, 1),
    "kg m2": (2, 0, 0, 1),
    "Pa": (-1, 0, -2, 1),
}
"""Units that have a name of their own."""
NONE: Powers = (Fraction(0),) * len(BASES)
IN_SI_TEXT = re.compile(r"(?<![\w.])(-?\d+\.?\d*(?:e[+-]?\d+)?) (m|rad|m/s|rad/s)(?![\w/])")
"""A length, an angle or a speed in SI within a message."""
LONG = 12
"""Letters of a number from which it is rounded in a message, whatever its unit."""
LENGTHS = ("m", "m/s", "m/s2", "m/s3")
FORCES = ("N", "N or N m")
MOMENTS = ("N m", "N or N m")


@dataclass(frozen=True)
class Unit:
    """A unit that is not SI.

    Parameters
    ----------
    suffix
        How keys of a file end, with the underscore.
    of
        What is measured in it, in words.
    si
        Units in SI that the suffix may stand for; the first is that of one of it.
    size
        What one is in SI, an exact fraction; of angles and turns times pi.
    pi
        Whether pi is a factor.
    """

    suffix: str
    of: str
    si: tuple[str, ...]
    size: Fraction
    pi: bool = False

    @property
    def name(self) -> str:
        """How it is written in tables: ``mm``, ``N mm``, ``rad/s``."""
        return NAMES.get(self.suffix, self.suffix[1:].replace("_", " "))

    @property
    def word(self) -> str:
        """How it is said."""
        return SAID.get(self.suffix, self.name)

    @property
    def factor(self) -> float:
        """What one is in SI."""
        return math.pi * float(self.size) if self.pi else float(self.size)

    @property
    def pattern(self) -> str:
        """How an expression is converted to SI."""
        above, below = self.size.numerator, self.size.denominator
        text = "({})" + ("*pi" if self.pi else "")
        text += f"*{above}" if above != 1 else ""
        return text + (f"/{below}" if below != 1 else "")


NAMES = {"_rad_s": "rad/s", "_hz": "turns/s", "_kg_cm2": "kg cm2"}
"""Suffixes whose unit is not written as they are."""
SAID = {"_in": "inches", "_ft": "feet", "_g": "grams", "_lb": "pounds", "_deg": "degrees"}
"""Suffixes that are said in words."""
INCH, POUND = Fraction("0.0254"), Fraction("0.45359237")
POUND_FORCE = POUND * Fraction("9.80665")
TABLE = (
    Unit("_deg", "angles and their rates", ("rad", "rad/s", "rad/s2", "rad/s3"),
         Fraction(1, 180), True),
    Unit("_rpm", "angular speeds", ("rad/s",), Fraction(1, 30), True),
    Unit("_rad_s", "angular speeds", ("rad/s",), Fraction(1)),
    Unit("_hz", "angular speeds", ("rad/s",), Fraction(2), True),
    Unit("_mm", "lengths and their rates", LENGTHS, Fraction(1, 1000)),
    Unit("_cm", "lengths and their rates", LENGTHS, Fraction(1, 100)),
    Unit("_in", "lengths and their rates", LENGTHS, INCH),
    Unit("_ft", "lengths and their rates", LENGTHS, 12 * INCH),
    Unit("_kN", "forces", FORCES, Fraction(1000)),
    Unit("_lbf", "forces", FORCES, POUND_FORCE),
    Unit("_N_mm", "moments", MOMENTS, Fraction(1, 1000)),
    Unit("_lbf_in", "moments", MOMENTS, POUND_FORCE * INCH),
    Unit("_g", "masses", ("kg",), Fraction(1, 1000)),
    Unit("_lb", "masses", ("kg",), POUND),
    Unit("_kg_cm2", "moments of inertia", ("kg m2",), Fraction(1, 10000)),
)  # fmt: skip
"""International definitions: 1 in = 25.4 mm, 1 lb = 0.45359237 kg, 1 lbf = 9.80665 m/s2 lb."""
UNITS: dict[str, Unit] = {unit.suffix: unit for unit in TABLE}
"""Endings of keys, and what they stand for."""
ONE = Fraction(1)
IN_SI = (
    Unit("_rad", "angles", UNITS["_deg"].si, ONE),
    Unit("_m", "lengths", LENGTHS, ONE),
    Unit("_N", "forces", FORCES, ONE),
    Unit("_N_m", "moments", MOMENTS, ONE),
    Unit("_kg", "masses", ("kg",), ONE),
    Unit("_kg_m2", "moments of inertia", ("kg m2",), ONE),
    Unit("_s", "times", ("s",), ONE),
    Unit("_m_s", "speeds", ("m/s",), ONE),
    Unit("_m_s2", "accelerations", ("m/s2",), ONE),
    Unit("_rad_s2", "angular accelerations", ("rad/s2",), ONE),
    Unit("_W", "powers", ("W",), ONE),
    Unit("_J", "energies", ("N m", "J"), ONE),
    Unit("_Pa", "pressures", ("Pa",), ONE),
    Unit("_N_per_m", "stiffnesses", ("N/m",), ONE),
    Unit("_N_s_per_m", "dampings", ("N s/m",), ONE),
    Unit("_N_m_per_rad", "stiffnesses of joints", ("N m/rad",), ONE),
    Unit("_N_m_s_per_rad", "dampings of joints", ("N m s/rad",), ONE),
)
EVERY: dict[str, Unit] = UNITS | {unit.suffix: unit for unit in IN_SI}
"""With those of SI, which names may end with too: they count where the name before is known."""


def nearest_suffixes(word: str) -> list[str]:
    """Return the suffixes that may have been meant by the end of a key (``inch``, ``newton``)."""
    said = word.lower().strip("_")
    known = {suffix[1:]: suffix for suffix in UNITS} | WORDS
    if said in known:
        return [known[said]]
    begun = [suffix for suffix in UNITS if said and suffix[1:].startswith(said)]
    near = [known[word] for word in nearest(said.removesuffix("s"), known)]
    return list(dict.fromkeys([*begun, *near]))[:3]


WORDS = {
    **dict.fromkeys(("degree", "grad", "deg"), "_deg"),
    **dict.fromkeys(("millimetre", "millimeter"), "_mm"),
    **dict.fromkeys(("centimetre", "centimeter"), "_cm"),
    **dict.fromkeys(("inch", "inche"), "_in"),
    **dict.fromkeys(("foot", "feet"), "_ft"),
    **dict.fromkeys(("kilonewton", "kn"), "_kN"),
    **dict.fromkeys(("nmm",), "_N_mm"),
    **dict.fromkeys(("inlbf", "lbfin", "lb_in", "in_lb", "in_lbf"), "_lbf_in"),
    **dict.fromkeys(("gram",), "_g"),
    **dict.fromkeys(("pound", "lbm"), "_lb"),
    **dict.fromkeys(("rev", "u_min", "1_min"), "_rpm"),
    **dict.fromkeys(("kgcm2",), "_kg_cm2"),
    **dict.fromkeys(("radps", "rps"), "_rad_s"),
}
"""What people write in place of suffixes."""


@cache
def powers_of(unit: str) -> Powers | None:
    """Return the exponents of a unit, None where the text names several or none."""
    if unit in NAMED:
        return tuple(Fraction(power) for power in NAMED[unit])
    if unit == "1":
        return NONE
    above, _, below = unit.partition("/")
    powers = dict.fromkeys(BASES, Fraction(0))
    for part, sign in ((above, 1), (below.replace("/", " "), -1)):
        for word in part.split():
            if word == "1":
                continue
            name = word.rstrip("0123456789")
            if name not in powers:
                return None
            powers[name] += sign * int(word[len(name) :] or 1)
    return tuple(powers.values()) if unit else None


def text_of(powers: Powers) -> str:
    """Return a unit as it is written."""
    for name in NAMED:
        if powers == powers_of(name):
            return name

    def word(name: str, power: Fraction) -> str:
        return name if power == 1 else f"{name}{power}"

    pairs = list(zip(BASES, powers, strict=True))
    above = [word(name, power) for name, power in pairs[-1:] + pairs[:-1] if power > 0]
    below = [word(name, -power) for name, power in pairs if power < 0]
    return "/".join([" ".join(above) or "1", *below])


def over(unit: str, below: str) -> str:
    """Return a unit divided by another one, "" where one of them is not known."""
    above, by = powers_of(unit), powers_of(below)
    return text_of(tuple(a - b for a, b in zip(above, by, strict=True))) if above and by else ""


def fits(suffix: str, powers: Powers, angles: bool = True) -> bool:
    """Return whether a suffix may stand for a unit, whatever its `angles` where these are left out.

    An angle may be a plain number: an arc is a radius times an angle.
    """
    units = [powers_of(si) for si in EVERY[suffix].si]
    if not angles:
        rad = BASES.index("rad")
        units = [unit and (*unit[:rad], powers[rad], *unit[rad + 1 :]) for unit in units]
    return powers in units


@dataclass(frozen=True)
class ShownUnit:
    """A unit that is shown, and the factor from SI to it."""

    name: str
    factor: float = 1.0


def per(unit: ShownUnit, *below: ShownUnit) -> ShownUnit:
    """Return the unit of a derivative, or of a price: one unit over others."""
    names = [f"({b.name})" if "/" in b.name or " " in b.name else b.name for b in below]
    name = "/".join([unit.name or "1", *(name for name in names if name not in ("", "1"))])
    return ShownUnit(name, unit.factor / math.prod(b.factor for b in below))


@dataclass(frozen=True)
class Units:
    """Units that numbers are shown in: those that were asked for, else those of the file.

    Parameters
    ----------
    asked
        Their names, as they were given: ``("mm", "deg")``.
    by_si
        Unit in SI -> what it is shown in; what is not in it is nobody's wish.
    written
        The units that the problem was written in, ``"mm,deg"``.
    """

    asked: tuple[str, ...] = ()
    by_si: Mapping[str, ShownUnit] = field(default_factory=lambda: MappingProxyType({}))
    written: str = ""

    def __bool__(self) -> bool:
        return bool(self.by_si)

    def of(self, si: str) -> ShownUnit:
        """Return what a unit in SI is shown in: itself where nothing else is wished."""
        if si in ("rad/m", "m/rad"):
            return per(*map(self.of, si.split("/")))
        return self.by_si.get(si) or ShownUnit(si)

    def read(self, si: str) -> ShownUnit:
        """Return what a unit in SI is shown in to readers: angles in degrees without a wish."""
        return DEGREES if si == "rad" and "rad" not in self.by_si else self.of(si)

    def in_text(self, text: str) -> str:
        """Return a message whose lengths, angles and speeds are in these units.

        One that asks whether metres are meant stays.
        """

        def shown(number: re.Match[str]) -> str:
            unit = self.of(number[2])
            if unit.factor == 1 and len(number[1]) < LONG:
                return number[0]
            return f"{float(number[1]) * unit.factor:.6g} {unit.name}"

        return text if "in metres" in text else IN_SI_TEXT.sub(shown, text)

    def say(self, error: MechdaeError) -> None:
        """Let an error be in these units."""
        error.what, error.hint = self.in_text(error.what), self.in_text(error.hint)
        error.where = self.in_text(error.where)

    def __reduce__(self) -> tuple[object, ...]:
        return units_of, (self.asked, self.written)


DEGREES = ShownUnit("deg", 180.0 / math.pi)
SI = Units()
"""No wish."""
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
    known["deg/s"] = ("rad/s", "deg/s", UNITS["_deg"].size, True)
    for unit in TABLE:
        quantity = unit.si[0]
        known.setdefault(unit.name, (quantity, unit.name, unit.size, unit.pi))
    spelled = {name.replace(" ", "_").replace("/", "_"): unit for name, unit in known.items()}
    suffixed = {unit.suffix[1:]: known[unit.name] for unit in TABLE}
    return {**spelled, **suffixed, **known}


KNOWN = _known()
SHOWN = tuple(dict.fromkeys(name for _, name, _, _ in KNOWN.values()))
"""How units are written, SI and others."""


def units_of(text: str | Sequence[str] | Units = (), written: str = "") -> Units:
    """Return the units that a text names: ``mm,deg,kN``; of other quantities those `written`.

    Those of other `Units` have the same names, and what these were written in.

    Lengths give the units of their rates, of areas and curvatures, angles those of their rates
    unless angular speeds have one of their own (``deg,rpm``).

    Raises
    ------
    UnknownName
        No unit, with the nearest.
    InputError
        Two units of one quantity, or none at all.
    """
    if isinstance(text, Units):
        return _units(text.asked, text.written or written)
    words = text.split(",") if isinstance(text, str) else text
    return _units(tuple(name.strip() for name in words), written)


@cache
def _units(names: tuple[str, ...], written: str) -> Units:
    chosen = _chosen(names)
    skipped = {*chosen, "rad/s"} if "rad" in chosen else {*chosen}
    words = [name.strip() for name in written.split(",")] if written else []
    for quantity, unit in _chosen(words).items():
        if quantity not in skipped:
            chosen[quantity] = unit
    by_si: dict[str, ShownUnit] = {}
    for quantity in POWERS:  # angles before angular speeds
        if quantity in chosen:
            name, size, pi = chosen[quantity]
            for si, (power, pattern) in POWERS[quantity].items():
                factor = float(1 / size**power) / (math.pi if pi else 1.0)
                by_si[si] = ShownUnit(pattern.format(name), factor)
    speed = by_si.get("rad/s", ShownUnit(""))
    if speed.name[-2:] == "/s" and speed.name != "turns/s":
        by_si |= {f"rad/s{n}": ShownUnit(f"{speed.name}{n}", speed.factor) for n in (2, 3)}
    return Units(names, MappingProxyType(by_si), written)


def _chosen(words: Sequence[str]) -> dict[str, tuple[str, Fraction, bool]]:
    """Return quantity -> name, size in SI and whether times pi of the units named."""
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
    return chosen


def _unknown(word: str) -> UnknownName:
    error = UnknownName("unit", word, SHOWN, where="units")
    meant = [suffix[1:] for suffix in nearest_suffixes(word)] if word else []
    names = list(dict.fromkeys(KNOWN[name][1] for name in meant if name in KNOWN))
    known = f"units are {', '.join(SHOWN)}"
    error.hint = f"did you mean {' or '.join(names)}? {known}" if names else known
    return error


def shown(unit: str, value: float) -> str:
    """Return a driver's value with its unit for people."""
    if unit == "rad":
        return f"{math.degrees(value):.6g} deg"
    return f"{value:.6g} m" if unit == "m" else f"{value:.6g}"
