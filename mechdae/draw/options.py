"""The options of pictures: one list of names for Python and for the command line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mechdae.errors import InputError, UnknownName

GRAPHS = ("losses", "map", "curves", "coupler")
DIAGRAMS = ("diagram", "animation")
DESIGNS = ("design", "compare", "convergence", "census")


@dataclass(frozen=True)
class Option:
    """An option, the kinds of pictures that have it, and what its value is.

    Parameters
    ----------
    kinds
        Kinds of pictures.
    what
        "names" (several), "name", "whole", "number", "on" or "off": a flag that is off or on
        without it; "value" is for Python alone.
    about
        What it is for.
    before
        Names that it had before, which are understood too, and the kinds that had them.
    """

    kinds: tuple[str, ...]
    what: str
    about: str
    before: Mapping[str, tuple[str, ...]] | None = None


OPTIONS: Mapping[str, Option] = {
    "of": Option(
        GRAPHS,
        "names",
        "what graphs show: paths below the task, of losses joints",
        {"paths": ("curves", "coupler", "map"), "joints": ("losses",)},
    ),
    "against": Option(("curves",), "name", "path of the abscissa of curves"),
    "along": Option(("map",), "names", "parameters along the axes of a map"),
    "equal": Option(("map",), "on", "a map with one scale on both axes"),
    "polar": Option(("curves", "losses"), "on", "reactions in the plane"),
    "extremes": Option(("curves",), "off", "no marks at least and greatest values"),
    "ticks": Option(("coupler",), "off", "no ticks of equal time on paths"),
    "pivots": Option(("coupler",), "off", "no fixed pivots beside paths"),
    "which": Option(
        ("plans",),
        "name",
        "of the plans: velocity, acceleration, force, friction, lever (default: one page)",
    ),
    "group": Option(("plans",), "name", "of the force polygons: that of one group"),
    "pose": Option(("diagram", "plans"), "whole", "number of the pose drawn, from 0"),
    "scale": Option(("diagram", "plans"), "number", "units for a millimetre of paper"),
    "label": Option(("diagram", "curves", "coupler"), "name", "name of the variant"),
    "traces": Option(DIAGRAMS, "off", "no paths of points"),
    "ghosts": Option(("diagram",), "whole", "number of other poses drawn faintly"),
    "labels": Option((*DIAGRAMS, "design"), "off", "no letters and numbers"),
    "loads": Option(DIAGRAMS, "off", "no loads"),
    "dark": Option(DIAGRAMS, "on", "colours for dark paper"),
    "lang": Option((*DIAGRAMS, *DESIGNS), "name", "language of the words: en, ru"),
    "shape": Option(("animation",), "whole", "number of the small motion shown, 1: the slowest"),
    "frames": Option(("animation",), "whole", "most frames of an animation"),
    "seconds": Option(("animation",), "number", "time of one round"),
    "dpi": Option(("animation",), "whole", "pixels to the inch"),
    "design": Option(("design",), "whole", "number of the design drawn"),
}
"""Name -> option."""


def checked(kind: str, given: Mapping[str, Any], dashes: str = "") -> dict[str, Any]:
    """Return the options of a kind of picture under their names of today.

    ``dashes`` stand before the names in messages.

    Raises
    ------
    UnknownName
        No picture has an option of that name.
    InputError
        The kind of picture has none, or it is there under two names.
    """
    found: dict[str, Any] = {}
    for word, value in given.items():
        name = next((own for own, option in OPTIONS.items() if word in (option.before or ())), word)
        if name not in OPTIONS:
            raise UnknownName(f"option of a picture of kind '{kind}'", word, names_of(kind))
        kinds = OPTIONS[name].kinds
        if name != word:
            kinds = (OPTIONS[name].before or {})[word]
        if kind not in kinds:
            shows = f": {kind} shows all poses" if name == "pose" and kind not in DESIGNS else ""
            own = ", ".join(f"{dashes}{known}" for known in names_of(kind))
            raise InputError(
                f"{dashes}{word} is for {', '.join(kinds)}, not for {kind}{shows}",
                where=f"{dashes}{word}",
                hint=f"options of {kind}: {own or 'none'}",
            )
        if name in found:
            raise InputError("this option is given twice, under two names", where=word)
        several = OPTIONS[name].what == "names"
        found[name] = [value] if several and isinstance(value, str) else value
    return found


def names_of(kind: str) -> list[str]:
    """Return the names of the options that a kind of picture has."""
    return [name for name, option in OPTIONS.items() if kind in option.kinds]


__all__ = ["DESIGNS", "DIAGRAMS", "GRAPHS", "OPTIONS", "Option", "checked", "names_of"]
