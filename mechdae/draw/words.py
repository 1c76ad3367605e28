"""The words of pictures, in each language from one table."""

from __future__ import annotations

import re
import tomllib
from functools import cache
from pathlib import Path

from mechdae.errors import UnknownName


@cache
def _tables() -> dict[str, dict[str, str]]:
    return tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def table(name: str) -> dict[str, str]:
    """Return the words of a language by their keys; of "units" the units in Russian."""
    return _tables()[name]


PREFIXES = {
    "en": ("n", "µ", "m", "", "k", "M", "G"),
    "ru": ("н", "мк", "м", "", "к", "М", "Г"),
}


UNIT = r"[A-Za-zµ]+(?:\$\^\d\$|\d|²|³)?"
"""A unit and its power."""


class Words:
    """The words of one language.

    Parameters
    ----------
    lang
        "en" or "ru".

    Raises
    ------
    UnknownName
        Another language.
    """

    def __init__(self, lang: str = "en") -> None:
        if lang not in PREFIXES:
            raise UnknownName("language", str(lang), list(PREFIXES))
        self.lang = lang

    def __call__(self, key: str, *values: object) -> str:
        """Return what is written for a key, with values put in."""
        return table(self.lang)[key].format(*values)

    def status(self, status: str) -> str:
        """Return the word for the status of a pose."""
        return table(self.lang).get(status, status)

    def number(self, value: float, digits: int = 6) -> str:
        """Return a number of so many significant digits with the language's decimal mark."""
        text = f"{value:.{digits}g}".replace("-", "\N{MINUS SIGN}")
        return text.replace(".", table(self.lang)["point"])

    def amount(self, value: float, unit: str) -> str:
        """Return a quantity with three significant digits and a prefix, such as ``1.2 kN``."""
        step = 0
        while abs(value) >= 999.5 * 1000.0**step and step < 3:
            step += 1
        while 0 < abs(value) < 0.9995 * 1000.0**step and step > -3:
            step -= 1
        prefix = PREFIXES[self.lang][step + 3]
        return f"{self.number(value / 1000.0**step, 3)} {prefix}{table(self.lang)[unit]}"


ENGLISH = Words()


def unit_in_russian(text: str) -> str:
    """Return a unit in Russian, or as it is: ``(m/s$^2$)`` is ``(м/с$^2$)``, ``N m`` ``Н·м``."""
    units = table("units")
    if text in units:
        return units[text]
    if not re.fullmatch(rf"\(?(1/)?{UNIT}([ /]{UNIT})*\)?", text):
        return text
    parts = re.split(r"([A-Za-zµ]+)", text)
    if not units.keys() >= {*parts[1::2]}:
        return text
    return "".join(units.get(part, part.replace(" ", "·")) for part in parts)
