"""Certificates: what was proved of a task, written down so that somebody else can check it."""

from __future__ import annotations

import importlib
import json
import tempfile
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from mechdae.describe.file.load import Source, given
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.values import Number
from mechdae.errors import InputError, SolveError, UnavailableError
from mechdae.records import public

if TYPE_CHECKING:
    from mechdae.describe import Problem
    from mechdae.types import Json

KINDS = ("sweep", "modes")
"""Kinds of tasks of which certificates are written."""


@public
def certify(
    problem: Source, task: Task | str | None = None, *, set: Mapping[str, Number] | None = None
) -> Json:
    """Return the certificate of a task, checked: plain data of texts, as its file has it.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    task
        A sweep or assembly modes; by default the first of these tasks.
    set
        Numbers to change, as of `md.solve`.

    Returns
    -------
    dict
        To be written as JSON; `check_certificate` reads the file.

    Raises
    ------
    UnavailableError
        Something in the task that certificates are not written for, by name; the extra
        ``proof`` is not installed.
    SolveError
        A claim does not stand the check in ball arithmetic.

    Examples
    --------
    >>> few = md.Sweep(md.Driver("crank.angle", from_=0.1, to=0.4), poses=3)
    >>> certificate = md.certify(md.slider_crank(0.1, 0.3), few)
    >>> len(certificate["poses"])
    3
    """
    loaded, named = given(problem, task, set)
    tasks = [name for name, entry in loaded.tasks.items() if entry.kind in KINDS]
    if named is None and not tasks:
        raise UnavailableError("no task of kind sweep or modes, which certificates are written of")
    _checker()
    from mechdae.parts.proof.write import certificate_of  # needs what the checker needs

    content = certificate_of(loaded, named or tasks[0])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "certificate"
        path.write_text(as_json(content), encoding="utf-8")
        check_certificate(path)
    return content


@public
def check_certificate(
    path: str | Path,
    problem: Source | None = None,
    *,
    set: Mapping[str, Number] | None = None,
) -> str:
    """Check a certificate in ball arithmetic, and return what was proved in words.

    Parameters
    ----------
    path
        File of the certificate.
    problem
        The problem of which it has to be: the numbers of the mechanism are compared.
    set
        Numbers of the problem to change.

    Returns
    -------
    str
        What was proved, in a sentence.

    Raises
    ------
    SolveError
        The first claim that does not hold or cannot be read, with its place.

    Examples
    --------
    >>> import json, pathlib, tempfile
    >>> few = md.Sweep(md.Driver("crank.angle", from_=0.1, to=0.4), poses=3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "proof.json")
    ...     _ = path.write_text(json.dumps(md.certify(md.slider_crank(0.1, 0.3), few)))
    ...     print(md.check_certificate(path)[:28])
    23 steps, 0 limit positions,
    """
    checker = _checker()
    try:
        proved: str = checker.check(str(path))
    except checker.FalseClaim as refused:
        place, _, why = str(refused).partition(": ")
        raise SolveError(f"refused: {why}", where=place) from None
    if problem is not None:
        _compare(json.loads(Path(path).read_text(encoding="utf-8")), given(problem, set=set)[0])
    return proved


def as_json(content: Json) -> str:
    """Return a certificate as the text of its file."""
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def _checker() -> ModuleType:
    try:
        return importlib.import_module("mechdae.parts.proof.checker")
    except ModuleNotFoundError as error:
        if error.name != "flint":
            raise
        raise UnavailableError(
            "certificates are checked in ball arithmetic, which needs python-flint",
            hint='pip install "mechdae[proof]"',
        ) from None


def _compare(content: Json, problem: Problem) -> None:
    """Raise where a certificate is not of this problem: name, task, mechanism."""
    from mechdae.parts.proof.write import mechanism_of_task

    name = content.get("task")
    if content.get("problem") != problem.name or name not in problem.tasks:
        raise InputError(
            f"of another problem or task: {str(content.get('problem'))[:60]}, {str(name)[:60]}",
            where="certificate",
        )
    here, there = mechanism_of_task(problem, str(name)), content["mechanism"]
    for part in ("bodies", "joints"):
        for name in sorted({*here[part], *there[part]}):
            if here[part].get(name) != there[part].get(name):
                raise SolveError("refused: not as in the problem", where=f"mechanism/{part}/{name}")
    if here["drivers"] != there["drivers"]:
        raise SolveError("refused: not as in the problem", where="mechanism/drivers")
