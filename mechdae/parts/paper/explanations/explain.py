"""`explain`: a document that computes one pose on paper."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

from mechdae.describe import Problem, Sweep
from mechdae.describe.file.load import Source, given
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.units import SI, Units
from mechdae.describe.values import Number
from mechdae.draw import plot
from mechdae.draw.diagram.driver import drivers_of, value_text
from mechdae.draw.figure import svg_text
from mechdae.draw.formulas.tree import Document, Facts, Image, Part, Section, number
from mechdae.draw.formulas.writers import as_data, as_html, as_text, as_typst
from mechdae.draw.words import Words
from mechdae.errors import InputError
from mechdae.parts.paper.explanations.forces import (
    BalanceOfLinks,
    PlaneBalance,
    driver_section,
    forces_section,
    power_section,
)
from mechdae.parts.paper.explanations.localised import Paper, in_lengths, localised, subject_of
from mechdae.parts.paper.explanations.motion import group_section
from mechdae.parts.paper.explanations.subject import KINDS, Subject
from mechdae.parts.paper.phrases import Phrases
from mechdae.records import public
from mechdae.results import Result
from mechdae.tasks.pictures import with_bodies
from mechdae.tasks.solve import solve

BESIDE = "87mm"
"""Width of a picture beside the text: half of a page's, where the scales of plans hold."""


class Explanation(Paper):
    """One pose on paper; its pictures are drawn when they are wanted.

    Attributes
    ----------
    document
        Its parts as values: headings, texts, formulas, tables.

    Examples
    --------
    >>> paper = md.explain(md.slider_crank(0.1, 0.3), pose=0)
    >>> list(paper.data())
    ['title', 'subtitle', 'lang', 'sections']
    """

    def __init__(
        self, document: Document, in_si: Document, pictures: Callable[[], tuple[Image, ...]]
    ) -> None:
        super().__init__(document)
        vars(self).update(_in_si=in_si, _pictures=pictures)

    @cached_property
    def illustrated(self) -> Document:
        """The document with the diagram and the plans beside it."""
        pictures: Callable[[], tuple[Image, ...]] = vars(self)["_pictures"]
        return replace(self.document, beside=pictures())

    def html(self) -> str:
        """Return it as one HTML file, the diagram and the plans of the pose beside the text."""
        return as_html(self.illustrated)

    def typ(self) -> str:
        """Return it in the markup of Typst, with its pictures in it."""
        return as_typst(self.illustrated)

    def _repr_html_(self) -> str:
        return as_html(self.illustrated, alone=False)

    def text(self) -> str:
        """Return it as text for a terminal."""
        return as_text(self.document)

    def data(self) -> dict[str, Any]:
        """Return it as plain data in SI: formulas as text, with their printed numbers."""
        return as_data(vars(self)["_in_si"])

    def json(self) -> str:
        """Return `data` as one JSON object."""
        return json.dumps(self.data(), ensure_ascii=False) + "\n"

    def save(self, path: str | Path, form: str) -> Path:
        """Write it in one of the forms ``text``, ``html``, ``typ``, ``json``, whole or not at all.

        Returns
        -------
        Path
            Where it is.
        """
        return self._written(Path(path), form)

    def __str__(self) -> str:
        return self.text()


@public
def explain(
    problem: Source,
    task: Task | str | None = None,
    *,
    set: Mapping[str, Number] | None = None,
    pose: int | None = None,
    group: str | None = None,
    lang: str = "en",
    units: str | Units = SI,
) -> Explanation:
    """Explain how one pose is computed, group by group.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    task
        Of a problem: a sweep or a task of kind reactions, by default the first one.
    set
        Numbers to change, as of `md.solve`.
    pose
        Index of the pose, negative from the end; by default one in which links are apart.
    group
        One group only, by its name in the structural formula (``II.1 RRR(2,3)``) or the
        beginning of it.
    lang
        ``"en"`` or ``"ru"``.
    units
        What lengths, forces and moments are shown in, ``"mm,kN"``; by default as in the file.
        Data and JSON stay SI.

    Returns
    -------
    Explanation
        Its numbers are those of the result; each equation closes to the digits printed.

    Raises
    ------
    InputError
        A pose that does not assemble, or that there is not; a result of another kind.
    UnknownName
        No such group or language.
    SolveError
        The mechanism does not assemble.

    Examples
    --------
    >>> paper = md.explain(md.slider_crank(0.1, 0.3), pose=0)
    >>> print(paper.text()[:60])
    Slider-crank
    ============
    slider-crank, turn: pose 0 of 361
    """
    say = Phrases(lang)
    if isinstance(problem, Result) and task is None and set is None:
        result = with_bodies(problem)
    else:
        whole, named = given(problem, task, set)
        result = with_bodies(solve(whole, first_task(whole, named)))
    result = in_lengths(result, units)
    subject = subject_of(result, pose, say)
    groups = subject.group(group)
    sections = [_head(subject)] if group is None else []
    sections += [_group(subject, name, bodies) for name, bodies in groups]
    if getattr(result, "efforts", None):
        sections.append(_forces(subject, groups, whole=group is None))
    title = result.title or result.problem
    name = f"{result.problem}, {result.task}" if result.task else result.problem
    place = say("pose", subject.pose, len(subject.scene.status))
    document = Document(title, f"{name}: {place}", tuple(sections), lang)
    shown = localised(document, result.units)
    alone = groups[0][0] if group is not None else None
    return Explanation(shown, localised(document), lambda: pictures(subject, say, alone))


def pictures(
    subject: Subject, say: Phrases, group: str | None = None, diagram: bool = True
) -> tuple[Image, ...]:
    """Return the diagram and the groups of a pose and its plans of rates, where it has.

    Of a group alone they are its pictures.
    """
    wanted: list[tuple[str, dict[str, str]]] = [("diagram", {})] if diagram and not group else []
    alone = {"group": group} if group else {}
    wanted += [("groups", alone)] * (diagram and subject.result.mechanism.dimension == 2)
    wanted += [("plans", {"which": which, **alone}) for which in ("velocity", "acceleration")]
    images: list[Image] = []
    for kind, options in wanted:
        more: dict[str, Any] = {**options, "pose": subject.pose, "lang": say.lang}
        try:
            drawn = plot(subject.result, kind, width=BESIDE, title=False, **more)
        except InputError:  # a pose without rates
            continue
        images.append(Image(svg_text(drawn), say(f"picture of {options.get('which', kind)}")))
    return tuple(images)


def _group(subject: Subject, name: str, bodies: tuple[str, ...]) -> Section:
    """Return the motion of one group, in the plane or in space."""
    if subject.result.mechanism.dimension == 2:
        return group_section(subject, name, bodies)
    from mechdae.parts.paper.explanations.space.spatial_motion import spatial_group_section

    return spatial_group_section(subject, name, bodies)  # type: ignore[arg-type]


def first_task(problem: Problem, task: str | None) -> str:
    """Return a task that can be explained: the one asked for, or the first.

    Raises
    ------
    InputError
        There is none, or the one asked for is of another kind.
    """
    if task is None:
        able = [name for name, kind in problem.tasks.items() if kind.kind in KINDS]
        if not able:
            hint = f"kind = {' or '.join(KINDS)}"
            raise InputError("no task that can be explained", where="tasks", hint=hint)
        return able[0]
    kind = problem.task(task).kind
    if kind not in KINDS:
        raise InputError(f"{', '.join(KINDS)} are explained, not {kind}", where=f"tasks.{task}")
    return task


def moving_task(problem: Problem, task: str | None, ends: bool = False) -> str:
    """Return the task asked for, else the first that can be explained over an interval.

    With ``ends`` only intervals whose ends are given count. Without any it is the first task.
    """
    for name, moving in problem.tasks.items() if task is None else ():
        drivers = moving.all_drivers if isinstance(moving, Sweep) else ()
        if drivers and all(one.at is None and not (ends and one.range) for one in drivers):
            return name
    return first_task(problem, task)


def _head(subject: Subject) -> Section:
    """Return what the pose is: drivers, formula, status, bound."""
    say, result, pose = subject.say, subject.result, subject.pose
    rows: list[tuple[str, tuple[str | Part, ...]]] = []
    formula = result.summary.get("formula")
    if formula:
        rows.append((say("formula"), (formula,)))
    values = [value_text(result, driver, pose) for driver in drivers_of(subject.scene, result)]
    rows.append((say("drivers"), ("; ".join(values).replace("$", ""),)))
    rows.append((say("status"), (Words(say.lang).status(str(result.status[pose])),)))
    bounds: list[str | Part] = []
    for word, unit in (("length", "m"), ("angle", "rad")):
        if word in result.bound:
            bounds += [", "] * bool(bounds) + [number(subject.value(result.bound, word), unit, 2)]
    rows.append((say("bound"), tuple(bounds)))
    assumed = result.summary.get("assumptions") or []
    rows += [(say("assumes"), (text,)) for text in assumed]
    return Section(say("mechanism"), (Facts(tuple(rows)),))


def _forces(subject: Subject, groups: list[tuple[str, tuple[str, ...]]], whole: bool) -> Section:
    """Return the equilibria from the last group to the first, then drivers and powers."""
    balance = _balance(subject)
    parts = [forces_section(balance, name, bodies) for name, bodies in reversed(groups)]
    if whole:
        check = power_section(balance)
        parts += [driver_section(subject), *([check] if check is not None else [])]
    return Section(subject.say("forces"), (), tuple(parts))


def _balance(subject: Subject) -> BalanceOfLinks:
    """Return what acts on the links, in the plane or in space."""
    if subject.result.mechanism.dimension == 2:
        return PlaneBalance(subject)
    from mechdae.parts.paper.explanations.space.spatial_forces import SpatialBalance

    return SpatialBalance(subject)  # type: ignore[arg-type]
