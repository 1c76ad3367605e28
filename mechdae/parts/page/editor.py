"""The editor as one HTML file, empty or with a problem file that its page opens."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from mechdae.describe import Problem, dumps, load
from mechdae.describe.file import library
from mechdae.describe.units import UNITS
from mechdae.draw.fragments import templates
from mechdae.errors import InputError
from mechdae.parts.page import link
from mechdae.parts.page.document import LANGUAGES, Page

if TYPE_CHECKING:
    from mechdae.types import Json


LARGEST = 200_000
"""Characters of a file that the editor's page opens."""
TEMPLATES = ("four-bar-crank-rocker", "slider-crank-offset", "watt-six-bar", "geared-five-bar",
             "toggle-press", "quick-return-pin", "rack-and-pinion", "cam-roller-follower",
             "excavator")  # fmt: skip
"""Problems to start a drawing with."""
EXPECTED = re.compile(r"^\[\[expected\]\]\n(?:[^\[\n].*\n)*\n?", re.M)


def editor(problem: Problem | str | Path | None = None, lang: str = "en") -> Page:
    """Return the editor.

    Parameters
    ----------
    problem
        What to go on with: a problem, the name of a predefined one, or a file. The page opens it
        as it opens files that are dropped on it: what it does not draw it names and keeps.
    lang
        Language of its words, "en" or "ru".

    Raises
    ------
    InputError
        A spatial mechanism, a file that is too large, a language that it does not speak.
    ProblemFileError
        A file that is no problem file.
    """
    if lang not in LANGUAGES:
        raise InputError(f"no words in '{lang}'", where="lang", hint=", ".join(LANGUAGES))
    text, name, title = "", "", "drawn mechanism"
    if problem is not None:
        if isinstance(problem, Problem):
            whole, text = problem, dumps(problem)
            name = f"{whole.name or 'problem'}.toml"
        else:
            path = library.find(problem)
            whole, text = load(path), path.read_text(encoding="utf-8-sig")
            name = path.name
        title = whole.title or whole.name
        if whole.mechanism.dimension != 2:
            raise InputError("the editor draws planar mechanisms", where="dimension")
        if len(text) > LARGEST:
            raise InputError(
                f"a file of {len(text) / 1000:.0f} kB",
                where=name,
                hint=f"the editor opens files up to {LARGEST // 1000} kB",
            )
    data: Json = {
        "schema": 1,
        "title": title,
        "problem": "" if problem is None else whole.name,
        "task": "",
        "lang": lang,
        "live": True,
        "reason": "",
        "text": text,
        "name": name,
        "templates": [_template(library.template(name)) for name in TEMPLATES],
        "units": {u.suffix: [u.size.numerator, u.size.denominator, u.pi] for u in UNITS.values()},
    }
    return Page(link.linked(data, None, "edit", templates()), data)


def _template(path: Path) -> Json:
    """Return a problem as it is opened: its file without what it is checked by."""
    text = path.read_text(encoding="utf-8")
    return {"name": path.name, "title": load(path).title, "text": EXPECTED.sub("", text)}
