"""Where the predefined problems are: inside the package, else beside it."""

from __future__ import annotations

import os
from pathlib import Path

from mechdae.errors import ProblemFileError, UnknownName, close_matches


def folder() -> Path:
    """Return the folder of the predefined problems (wheel, editable install, checkout)."""
    package = Path(__file__).resolve().parents[2]
    inside = package / "problems"
    return inside if inside.is_dir() else package.parent / "problems"


def paths() -> list[Path]:
    """Return the files of the predefined problems, by name."""
    return sorted(folder().glob("*.toml"), key=lambda path: path.stem)


def names() -> list[str]:
    """Return the names of the predefined problems, sorted."""
    return [path.stem for path in paths()]


def template(name: str) -> Path:
    """Return the file to start from of that name: a template, else a predefined problem."""
    path = folder() / "templates" / f"{name}.toml"
    return path if path.is_file() else folder() / f"{name}.toml"


def families() -> list[str]:
    """Return the names of the templates."""
    return sorted(path.stem for path in (folder() / "templates").glob("*.toml"))


def new(name: str) -> str:
    """Return the commented text of a template or a predefined problem, to start a file from.

    Parameters
    ----------
    name
        Such as ``"four-bar"``; a name of ``mechdae new`` or ``mechdae list``.

    Returns
    -------
    str
        A problem file, TOML.

    Raises
    ------
    UnknownName
        Neither a template nor a predefined problem.

    Examples
    --------
    >>> md.new("four-bar").splitlines()[0]
    'schema = 1'
    """
    known = dict.fromkeys([*families(), *names()])
    if name not in known:
        error = UnknownName("family", name, known)
        error.hint = (
            error.hint or f"families are {', '.join(families())}; `mechdae list` names more"
        )
        raise error
    return template(name).read_text(encoding="utf-8")


def find(name_or_path: str | Path) -> Path:
    """Return the file of a predefined problem or the path as given.

    A text with a separator or ending in ``.toml`` is a path, anything else a name.
    """
    text = str(name_or_path)
    if isinstance(name_or_path, Path) or "/" in text or "\\" in text or text.endswith(".toml"):
        path = Path(text)
        if not path.exists():
            near = close_matches(path.name, (file.name for file in path.parent.glob("*.toml")), 3)
            hint = f"did you mean {' or '.join(near)}?" if near else ""
            raise ProblemFileError("there is no such file", where=text, hint=hint)
        return path
    path = folder() / f"{text}.toml"
    if not os.path.isfile(path):  # Path.is_file raises for names that are too long
        error = UnknownName("problem", text, names(), where="predefined problems")
        if Path(f"{text}.toml").is_file():
            error.hint = f"did you mean the file {text}.toml?"
        error.hint = error.hint or "`mechdae list` names them; the path of a file ends in .toml"
        raise error
    return path
