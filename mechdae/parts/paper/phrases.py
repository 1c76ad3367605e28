"""The phrases of papers, in each language from one file of `words`."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

from mechdae.describe.units import SI, Units
from mechdae.draw.graphs.scale import raised
from mechdae.draw.words import unit_in_russian
from mechdae.errors import UnknownName

WORDS = Path(__file__).parent / "words"


@cache
def phrases(paper: str) -> dict[str, dict[str, str]]:
    """Return the phrases of a kind of paper by language."""
    return tomllib.loads((WORDS / f"{paper}.toml").read_text(encoding="utf-8"))


class Phrases:
    """The phrases of one language, and the units that numbers among them are in."""

    def __init__(self, lang: str, paper: str = "explanations", units: Units = SI) -> None:
        table = phrases(paper)
        if lang not in table:
            raise UnknownName("language", lang, list(table))
        self._table = table[lang]
        self.lang: str = lang
        self.units: Units = units

    def __call__(self, key: str, *values: object) -> str:
        return self._table[key].format(*values)

    def unit(self, text: str) -> str:
        """Return a unit as the language writes it."""
        return raised(unit_in_russian(text) if self.lang == "ru" else text)

    def kind(self, name: str) -> str:
        """Return the name of a kind of joint, as the file has it where there is no other."""
        return self._table.get(name, name)
