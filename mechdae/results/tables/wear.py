"""Wear of contacts along a cycle as text."""

from __future__ import annotations

from mechdae.results.units import WEAR
from mechdae.types import Json

TITLES = {word: f"{word.replace('_', ' ')} [{unit}]" for word, unit in WEAR.items()}


def wear_lines(contacts: dict[str, Json]) -> list[str]:
    """Return a line for each contact, with a title."""
    size = max(map(len, contacts))
    lines = [f"  wear      {'':{size}}  " + "  ".join(TITLES.values())]
    for name, wear in contacts.items():
        cells = (f"{wear[word]:>{len(title)}.6g}" for word, title in TITLES.items())
        lines.append(f"            {name:{size}}  " + "  ".join(cells))
    return lines
