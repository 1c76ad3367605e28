"""Options of the pictures that a command draws, and what their files are called."""

from __future__ import annotations

import re
import zlib
from collections.abc import Mapping
from typing import TYPE_CHECKING

from mechdae.draw.catalogue import OPTIONS, checked
from mechdae.errors import InputError

if TYPE_CHECKING:
    from mechdae.types import Json


LONGEST = 150
"""Letters of a file's name without its ending; longer ones are cut, with a checksum."""


def options_for(kind: str, asked: Mapping[str, int | str | list[str]]) -> Json:
    """Return the options of the drawing function."""
    options = checked(kind, asked, "--")
    if "design" in options:
        if options["design"] < 1:
            raise InputError("a number from 1, the best one", where="--design")
        options["design"] -= 1
    return options


def file_name(
    problem: str, task: str, kind: str, asked: Mapping[str, int | str | list[str]]
) -> str:
    """Return the name of the file of a picture, without the ending: it says what is asked for."""
    given = {
        name: OPTIONS[name].file.format(_in_name(value)) for name, value in asked.items() if value
    }
    which = given.pop("which", "")
    given |= {"pose": OPTIONS["pose"].file.format(asked["pose"])} if "pose" in asked else {}
    whole = "-".join([problem, task, which or kind, *filter(None, given.values())])
    if len(whole) <= LONGEST:
        return whole
    return f"{whole[:LONGEST]}-{zlib.crc32(whole.encode()):08x}"


def _in_name(value: int | str | list[str]) -> str:
    """Return the value of an option as a part of a file's name."""
    texts = value if isinstance(value, list | tuple) else [value]
    return "-".join(re.sub(r"[^\w.,+=-]+", "-", str(text)).strip("-") for text in texts)
