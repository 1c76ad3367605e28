"""The words of pictures, in each language from one table."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from mechdae.errors import UnknownName

TABLE: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "en": MappingProxyType(
            {
                "absent": "not in the scene",
                "dashed": "dashed, not in the scene",
                "unasked": "not in the result",
                "undrawn": "not drawn",
                "pose": "pose",
                "pose of": "pose {0} of {1}",
                "mode of": "mode {0}, {1} of {2}",
                "ok": "ok",
                "limit": "limit",
                "unassembled": "unassembled",
                "singular": "singular",
                "ambiguous": "ambiguous",
                "m": "m",
                "mm": "mm",
                "km": "km",
                "µm": "µm",
                "N": "N",
                "N m": "N m",
                "point": ".",
            }
        ),
        "ru": MappingProxyType(
            {
                "absent": "вне сцены",
                "dashed": "штрихами, вне сцены",
                "unasked": "нет в результате",
                "undrawn": "не показаны",
                "pose": "положение",
                "pose of": "положение {0} из {1}",
                "mode of": "сборка {0}, {1} из {2}",
                "ok": "верно",
                "limit": "предельное",
                "unassembled": "не собирается",
                "singular": "особое",
                "ambiguous": "неоднозначное",
                "m": "м",
                "mm": "мм",
                "km": "км",
                "µm": "мкм",
                "N": "Н",
                "N m": "Н·м",
                "point": ",",
            }
        ),
    }
)
"""Language -> key -> what is written. Names that the user gave stay as they are."""
PREFIXES = {
    "en": ("n", "µ", "m", "", "k", "M", "G"),
    "ru": ("н", "мк", "м", "", "к", "М", "Г"),
}


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
        if lang not in TABLE:
            raise UnknownName("language", str(lang), list(TABLE))
        self.lang = lang

    def __call__(self, key: str, *values: object) -> str:
        """Return what is written for a key, with values put in."""
        return TABLE[self.lang][key].format(*values)

    def status(self, status: str) -> str:
        """Return the word for the status of a pose."""
        return TABLE[self.lang].get(status, status)

    def number(self, value: float, digits: int = 6) -> str:
        """Return a number of so many significant digits with the language's decimal mark."""
        text = f"{value:.{digits}g}".replace("-", "\N{MINUS SIGN}")
        return text.replace(".", TABLE[self.lang]["point"])

    def amount(self, value: float, unit: str) -> str:
        """Return a quantity with three significant digits and a prefix, such as ``1.2 kN``."""
        step = 0
        while abs(value) >= 999.5 * 1000.0**step and step < 3:
            step += 1
        while 0 < abs(value) < 0.9995 * 1000.0**step and step > -3:
            step -= 1
        prefix = PREFIXES[self.lang][step + 3]
        return f"{self.number(value / 1000.0**step, 3)} {prefix}{TABLE[self.lang][unit]}"


ENGLISH = Words()
