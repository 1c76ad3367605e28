"""Files of a mechanism in other programs' formats, and problems from other programs' files."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mechdae.additions import Added, Registry
from mechdae.describe import Problem, whole_file
from mechdae.describe.file.load import Source, given
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.values import Number
from mechdae.errors import InputError, UnknownName
from mechdae.records import public
from mechdae.tasks.motion_of import motion_of

FORMATS: Registry[Added] = Registry(
    "formats",
    {
        "dxf": Added(
            "mechdae.parts.exchange.drawings.dxf:dxf", about="drawing for CAD, release 12"
        ),
        "mjcf": Added(
            "mechdae.parts.exchange.robots.mjcf:mjcf",
            about="MuJoCo: tree of joints, equalities for loops",
        ),
        "sdf": Added(
            "mechdae.parts.exchange.robots.sdf:sdf",
            about="SDFormat: links and joints, loops among them",
        ),
        "step": Added(
            "mechdae.parts.exchange.workshop.step:step",
            about="the same solids with true circles, for CAD",
        ),
        "stl": Added(
            "mechdae.parts.exchange.workshop.cut:stl",
            about="solids to print: plates in layers, pins, spacers, a list of parts",
        ),
        "svg-cut": Added(
            "mechdae.parts.exchange.workshop.cut:svg_cut",
            about="sheet to cut at true size, a list of parts",
        ),
        "urdf": Added(
            "mechdae.parts.exchange.robots.urdf:urdf",
            about="tree of joints; loops and mimic polynomials beside it",
        ),
    },
    lambda added: added,
)
"""Formats, each with what writes it of an `ExportedMotion`."""


@dataclass(frozen=True, repr=False)
class Exported:
    """The files of an export.

    Attributes
    ----------
    format
        One of `FORMATS`.
    files
        Texts by what is put behind the name of the file: "" is the file itself; without a point
        it takes the place of the name's ending.

    Examples
    --------
    >>> files = md.export(md.four_bar(0.1, 0.04, 0.12, 0.08), format="urdf")
    >>> files.format, files.text[:5]
    ('urdf', '<?xml')
    """

    format: str
    files: Mapping[str, str]

    @property
    def text(self) -> str:
        """The file itself."""
        return self.files[""]

    def save(self, path: str | Path, overwrite: bool = False) -> list[Path]:
        """Write all files, or none of them.

        Parameters
        ----------
        path
            Of the first file; others stand next to it.
        overwrite
            Whether files may be there already.

        Returns
        -------
        list of Path
            Where they are: the one asked for first.

        Raises
        ------
        InputError
            No such folder, or a file that is there already.
        """
        targets = places(path, self.files, overwrite)
        with ExitStack() as stack:
            for target, text in zip(targets, self.files.values(), strict=True):
                stack.enter_context(whole_file(target)).write(text.encode("utf-8"))
        return targets

    def __repr__(self) -> str:
        sizes = ", ".join(f"{len(text)} bytes" for text in self.files.values())
        return f"<Exported {self.format}: {sizes}>"


def places(path: str | Path, files: Mapping[str, str], overwrite: bool) -> list[Path]:
    """Return where files go, after a look at what is there."""
    target = Path(path)
    if not target.name:
        raise InputError("not the name of a file", where=str(path))
    if not target.parent.is_dir():
        raise InputError("no such folder", where=str(target.parent))
    targets = [
        target.with_suffix(f".{ending}")
        if ending and not ending.startswith(".")
        else target.with_name(target.name + ending)
        for ending in files
    ]
    if len({*targets}) < len(targets):
        raise InputError("the name of another file of this export", where=str(target))
    for file in targets:
        if file.is_dir():
            raise InputError("is a folder", where=str(file))
        if file.exists() and not overwrite:
            raise InputError("exists already", where=str(file), hint="another name, or --overwrite")
    return targets


def check_format(form: str) -> None:
    """Raise `UnknownName` for a format that there is none of."""
    if form not in FORMATS:
        raise UnknownName("format", form, FORMATS, where="format", listed=FORMATS)


@public(old="problem format task")
def export(
    problem: Source,
    task: Task | str | None = None,
    *,
    format: str,
    set: Mapping[str, Number] | None = None,
    **options: float,
) -> Exported:
    """Return a mechanism in another program's format.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    format
        "dxf", "mjcf", "sdf", "urdf", "c", "js", "step", "stl" or "svg-cut".
    task
        A sweep, a task of reactions or a motion: by default the first sweep over a range. It
        gives the pose of the model, the paths of a drawing, the range of a polynomial.
    set
        Numbers to change, as of `md.solve`.
    **options
        ``pose`` of a drawing, from 0; ``tolerance`` of the polynomials of a URDF; of parts
        ``width``, ``thickness``, ``pin`` (diameter), ``clearance``, ``air``, ``module``,
        ``backlash`` and ``kerf`` [m], ``teeth`` of the smallest wheel.

    Returns
    -------
    Exported
        The text of each file; ``save`` writes them.

    Raises
    ------
    UnknownName
        No such format or task.
    UnavailableError
        Something that the format cannot hold, by name.
    SolveError
        The mechanism does not assemble.

    Examples
    --------
    >>> files = md.export(md.four_bar(0.1, 0.04, 0.12, 0.08), format="urdf")
    >>> files.text.splitlines()[0]
    '<?xml version="1.0"?>'
    """
    check_format(format)
    cut = (
        "width", "thickness", "pin", "clearance", "air", "module", "teeth", "backlash", "kerf",
    )  # fmt: skip
    known = {
        "dxf": ("pose",), "urdf": ("tolerance",), "svg-cut": cut,
        **dict.fromkeys(("step", "stl"), cut[:-1]),
    }.get(format, ())  # fmt: skip
    for name in options:
        if name not in known:
            raise InputError(
                f"no option of format {format}", where=name, hint=", ".join(known) or "none"
            )
    whole, named = given(problem, task, set)
    write = FORMATS[format].load()
    return Exported(format, write(motion_of(whole, named, "thickness" in known), **options))


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
