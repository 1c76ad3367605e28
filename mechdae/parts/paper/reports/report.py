"""`report`: one document of a task, as a student hands it in."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mechdae import __version__
from mechdae.describe import Problem
from mechdae.describe.file.load import Source, given
from mechdae.describe.tasks.kinds import Driven, Task
from mechdae.describe.units import SI, Units
from mechdae.describe.values import Number
from mechdae.draw import plot
from mechdae.draw.figure import new_axes, svg_text
from mechdae.draw.formulas.tree import Document, Image, Passage, Section
from mechdae.errors import InputError, UnavailableError
from mechdae.parts.paper.explanations.explain import moving_task
from mechdae.parts.paper.explanations.localised import Paper, in_lengths, localised, subject_of
from mechdae.parts.paper.explanations.subject import Subject
from mechdae.parts.paper.phrases import Phrases
from mechdae.parts.paper.reports import sections
from mechdae.records import public
from mechdae.results import Result
from mechdae.tasks.pictures import with_bodies
from mechdae.tasks.solve import solve

FINE = 360
"""Poses of a cycle that curves and paths are drawn with, at least."""
MOST = 360
"""Positions in a table, at most."""
PLAN = (1.0, 0.85)
"""Size of a plan beside the usual figure: as wide as the text, two on a page."""
ENDINGS = (".html", ".typ", ".pdf")


class Report(Paper):
    """The report of a task, one document.

    Attributes
    ----------
    document
        Its parts as values: headings, texts, formulas, tables, pictures.

    Examples
    --------
    >>> report = md.report(md.slider_crank(0.1, 0.3), positions=4)
    >>> report.typ()[:10]
    '#set docum'
    """

    def pdf(self) -> bytes:
        """Return it as PDF.

        Raises
        ------
        UnavailableError
            The package typst is not installed.
        """
        try:
            import typst
        except ImportError:
            raise UnavailableError(
                "a PDF needs the package typst",
                hint='pip install "mechdae[report]", or print the .html from a browser',
            ) from None
        made: bytes = typst.compile(self.typ().encode("utf-8"))
        return made

    def save(self, path: str | Path) -> Path:
        """Write ``.html``, ``.typ`` or ``.pdf``, whole or not at all; the same bytes each time.

        Returns
        -------
        Path
            Where it is.

        Raises
        ------
        InputError
            Another ending, or no such folder.
        UnavailableError
            A PDF without the package typst.
        """
        target = Path(path)
        writable(target)
        return self._written(target, target.suffix[1:])


def writable(target: Path) -> None:
    """Raise `InputError` for a file that no report is written to."""
    if target.suffix not in ENDINGS:
        raise InputError(
            f"a report is not written as '{target.suffix}'",
            where=str(target),
            hint=" ".join(ENDINGS),
        )
    if not target.parent.is_dir():
        raise InputError("no such folder", where=str(target.parent))


@public
def report(
    problem: Source,
    task: Task | str | None = None,
    *,
    set: Mapping[str, Number] | None = None,
    positions: int = 12,
    pose: int = 1,
    lang: str = "en",
    units: str | Units = SI,
) -> Report:
    """Return the report of a task: assignment, diagram, structure, positions, rates, forces.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    task
        A sweep or a task of kind reactions; by default the first one over an interval.
    set
        Numbers to change, as of `md.solve`.
    positions
        How many positions the tables have: equally spaced along the driver, the first one at the
        start of its range.
    pose
        Number of the position that is explained in full, from 0.
    lang
        ``"en"`` or ``"ru"``.
    units
        What lengths, forces and moments are shown in, ``"mm,kN"``; by default as in the file.

    Returns
    -------
    Report
        ``save`` writes it as HTML, Typst or PDF.

    Raises
    ------
    InputError
        A number of positions that makes no table, a task of another kind.
    UnknownName
        No such language.
    SolveError
        The mechanism does not assemble.

    Examples
    --------
    >>> report = md.report(md.slider_crank(0.1, 0.3), positions=4)
    >>> "<html" in report.html()
    True
    """
    say = Phrases(lang, "reports")
    if not 1 <= positions <= MOST:
        raise InputError(f"{positions} positions", hint=f"a whole number from 1 to {MOST}")
    whole, named = given(problem, task, set)
    name = moving_task(whole, named)
    result, rows = _solved(whole, name, positions)
    result = in_lengths(result, units)
    say = Phrases(lang, "reports", result.units)
    if not 0 <= pose < len(rows):
        raise InputError(f"there is no position {pose}", hint=f"from 0 to {len(rows) - 1}")
    subject = subject_of(result, _near(result, rows, pose), Phrases(lang))
    chosen = rows.index(subject.pose)
    parts = (
        sections.assignment(whole, result, say),
        _diagram(result, subject, chosen, say, lang),
        _structure(whole, subject, say),
        sections.in_full(result, subject, chosen, say, lang),
        sections.position_tables(subject, rows, say),
        *sections.force_tables(subject, rows, say),
        _pictures(result, subject, chosen, say),
        sections.checks(result, subject, say),
    )
    title = say("report", result.title or whole.name)
    made = Document(title, say("computed by", __version__), parts, lang)
    return Report(localised(made, result.units))


def _solved(problem: Problem, name: str, positions: int) -> tuple[Result, list[int]]:
    """Return the result, fine enough for curves, and the rows that are positions of the table."""
    task = problem.task(name)
    assert isinstance(task, Driven)
    if any(driver.at is not None for driver in task.all_drivers):
        result = with_bodies(solve(problem, name))
        every = range(len(result.status))
        return result, list(every[:: max(1, -(-len(every) // positions))])
    step = max(1, -(-FINE // positions))
    poses: dict[str, Any] = {"poses": positions * step + 1}
    fine = dataclasses.replace(task, **poses)
    result = with_bodies(solve(problem.with_task(name, fine), name))
    rows = [k * step for k in range(positions)]
    return result, rows if len(result.status) > rows[-1] else list(range(len(result.status)))


def _near(result: Result, rows: list[int], wanted: int) -> int:
    """Return the row of the position to explain: the one asked for, or the next that is there."""
    good = [row for row in rows if str(result.status[row]) in ("ok", "limit", "ambiguous")]
    if not good:
        raise InputError("no position of the table assembles", hint="mechdae solve says why")
    return min(good, key=lambda row: abs(row - rows[wanted]))


# -- pictures ----------------------------------------------------------------------------------


def _diagram(result: Result, subject: Subject, chosen: int, say: Phrases, lang: str) -> Section:
    svg = svg_text(plot(result, "diagram", pose=subject.pose, lang=lang, title=False))
    return Section(say("diagram"), (Image(svg, say("diagram of", chosen), 0.62),))


def _structure(problem: Problem, subject: Subject, say: Phrases) -> Section:
    """Return mobility and groups, in the plane with a picture of them."""
    section = sections.structure_of(problem, subject, say)
    if problem.mechanism.dimension != 2:
        return section
    drawn = plot(subject.result, "groups", pose=subject.pose, lang=say.lang, title=False)
    image = Image(svg_text(drawn), say("groups apart"), 0.62)
    return dataclasses.replace(section, blocks=(*section.blocks, image))


def _pictures(result: Result, subject: Subject, chosen: int, say: Phrases) -> Section:
    """Return plans of forces and curves; what a result has no picture of is left out.

    A plan has its own figure, as wide as the text on paper: the scale written on it holds there.
    """
    wanted: list[tuple[str, str, dict[str, Any]]] = []
    if getattr(result, "efforts", None):
        for group, _ in reversed(subject.groups):
            caption = say("plan force", group, chosen)
            wanted.append(("plans", caption, {"which": "force", "group": group}))
    wanted += [("curves", say("curves of"), {}), ("losses", say("losses"), {})]
    images: list[Passage] = []
    for kind, caption, options in wanted:
        if kind == "plans":
            options |= {"pose": subject.pose, "ax": new_axes(larger=PLAN)}
        try:
            drawn = plot(result, kind, lang=say.lang, title=False, **options)
        except InputError:
            continue
        images.append(Image(svg_text(drawn), caption))
    return Section(f"{say('plans')}. {say('curves')}", tuple(images))
