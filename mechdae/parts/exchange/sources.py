"""Problems from other programs' files: DXF sketches, assemblies of Ondsel and FreeCAD."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mechdae.describe import Problem
from mechdae.errors import InputError

ENDINGS = (".dxf", ".asmt")


def read_drawing(path: str | Path, **options: tuple[tuple[float, float]]) -> Problem:
    """Return the problem that a file of another program holds.

    Parameters
    ----------
    path
        A DXF sketch (``.dxf``) or an assembly of Ondsel or FreeCAD (``.asmt``).
    **options
        ``unit`` of a sketch or assembly, ``ground``: places of fixed pins of a sketch, in its unit.

    Returns
    -------
    Problem
        Sketched as drawn, with a sweep of its driver.

    Raises
    ------
    InputError
        A file that holds no mechanism, a joint that has no counterpart, by name.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = f"{folder}/bar.dxf"
    ...     _ = md.export(md.four_bar(0.1, 0.04, 0.12, 0.08), format="dxf").save(path)
    ...     problem = md.read_drawing(path)
    >>> list(problem.mechanism.joints)
    ['A', 'B', 'C', 'D']
    """
    return with_remarks(path, **options)[0]


def with_remarks(path: str | Path, **options: Any) -> tuple[Problem, list[str]]:
    """Return the problem, and remarks on what was made of the file."""
    ending = Path(path).suffix.lower()
    known = {".dxf": ("unit", "ground"), ".asmt": ("unit",)}.get(ending, ())
    for name in options:
        if known and name not in known:
            raise InputError(f"no option of {ending} files", where=name, hint=", ".join(known))
    if ending == ".dxf":
        from mechdae.parts.exchange.drawings.from_drawing import problem_of_drawing

        return problem_of_drawing(path, **options)
    if ending == ".asmt":
        from mechdae.parts.exchange.assemblies.from_assembly import problem_of_assembly

        return problem_of_assembly(path, **options)
    raise InputError(f"'{ending}' is not read", where=str(path), hint=" ".join(ENDINGS))
