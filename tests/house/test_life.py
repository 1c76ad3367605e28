"""The way of a planar four-bar, from its file to a table: what it enters is for it."""

from __future__ import annotations

from functools import cache
from typing import Any

import mechdae
from tests.shared.modules import imports
from tests.shared.walk import PACKAGE, four_bar

FILES, ROOMS, CHANGES, SHARE = 68, 8, 1192, 0.61
"""At most so many files, rooms and changes of file, at least that share of what stands there.

The modules that stand alone, above all rooms, are one. They may only get better: a change that
raises one of them lowers it elsewhere.
"""
RARE = ("cases/", "crossings", "tree/", "multistart", "vector", "parts/", "fold_approach")
"""Parts of names of files that a four-bar has nothing to do with."""


@cache
def way() -> dict[str, Any]:
    return four_bar()


def test_a_four_bar_enters_few_files() -> None:
    assert len(way()["files"]) <= FILES, "files that a four-bar enters: import it where it is used"
    assert len(way()["rooms"]) <= ROOMS, "rooms that a four-bar enters"
    assert way()["changes"] <= CHANGES, "calls from file to file on the way of a four-bar"


def test_the_page_lists_the_files_in_their_order() -> None:
    import make_life

    assert make_life.main(["--check"]) == 0, "python docs/make_life.py writes the page anew"


def test_what_stands_in_them_is_mostly_for_it() -> None:
    assert way()["share"] >= SHARE


def test_it_does_not_enter_what_it_has_not() -> None:
    assert not {name for name in way()["files"] if any(word in name for word in RARE)}


def test_plain_files_name_no_case() -> None:
    """In strings neither: cases add themselves. Annotations may name what they are of."""
    for name in way()["files"]:
        named = {own for own in imports(PACKAGE / name) if own.startswith((*mechdae.CASES,))}
        assert not named, name
