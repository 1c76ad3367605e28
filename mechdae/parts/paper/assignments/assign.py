"""`assign`: many variants of one problem, each with its file, its sheet and its answer key."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import re
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from math import degrees, pi, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechdae import __version__
from mechdae.describe import Problem, Sweep, Table, Task
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.file.load import Source, given
from mechdae.describe.file.writing import alone
from mechdae.describe.units import SI, Units, units_of
from mechdae.describe.values import Number
from mechdae.draw import plot
from mechdae.draw.figure import svg_text
from mechdae.draw.formulas.tree import Document, Section
from mechdae.errors import InputError, UnknownName
from mechdae.parts.paper.assignments.answers import Exercise, answers_of, key_sections
from mechdae.parts.paper.assignments.choice import Chosen, RoundRange, choose, ranges, transmission
from mechdae.parts.paper.assignments.sheet import sheet_sections
from mechdae.parts.paper.explanations.explain import moving_task
from mechdae.parts.paper.explanations.localised import localised, subject_of
from mechdae.parts.paper.phrases import Phrases
from mechdae.parts.paper.reports.report import ENDINGS, MOST, Report
from mechdae.records import dataclass, public
from mechdae.tasks import Solver
from mechdae.tasks.pictures import with_scene

if TYPE_CHECKING:
    from mechdae.types import Json


USUAL = 30
"""Variants where no number is asked for."""
ANGLE = radians(30.0)
"""Least transmission angle where none is asked for [rad]."""
LARGEST = 1000
"""Variants at once, at most."""


@dataclass(frozen=True)
class Assignment:
    """One variant.

    Parameters
    ----------
    number
        From 1.
    values
        The numbers that were drawn, by the names and in the units in which they were asked for.
    problem
        Its problem, without values expected of another one.
    sheet, key
        What students get, and the answers.
    transmission
        Least transmission angle [rad] of each dyad over the task, by joint.
    student
        Who gets it, empty without names.

    Examples
    --------
    >>> ranges = {"crank_mm": (30, 40, 5)}
    >>> variant = md.assign(md.slider_crank(0.03, 0.18), vary=ranges, count=1, positions=4)[0]
    >>> variant.number, variant.values
    (1, {'crank_mm': 35.0})
    """

    number: int
    values: Mapping[str, float]
    problem: Problem
    sheet: Report
    key: Report
    transmission: Mapping[str, float]
    student: str = ""


@dataclass(frozen=True)
class Assignments(Sequence[Assignment]):
    """Variants of a problem; `save` writes them into a folder.

    Parameters
    ----------
    name
        Name of the problem.
    variants
        In the order in which they were drawn.
    tried
        How many sets of numbers were tried for them.

    Examples
    --------
    >>> ranges = {"crank_mm": (30, 40, 5)}
    >>> variants = md.assign(md.slider_crank(0.03, 0.18), vary=ranges, count=2, positions=4)
    >>> len(variants), variants.table().splitlines()[0]
    (2, 'variant,crank_mm,transmission of C [deg]')
    """

    name: str
    variants: tuple[Assignment, ...]
    tried: int

    def __getitem__(self, k: Any) -> Any:
        return self.variants[k]

    def __len__(self) -> int:
        return len(self.variants)

    def table(self) -> str:
        """Return a CSV table of the numbers of all variants and their transmission angles."""
        names = list(self.variants[0].values)
        joints = list(self.variants[0].transmission)
        out = io.StringIO()
        rows = csv.writer(out, lineterminator="\n")
        named = ["student"] * any(variant.student for variant in self.variants)
        angles = [f"transmission of {joint} [deg]" for joint in joints]
        rows.writerow(["variant", *named, *names, *angles])
        for variant in self.variants:
            angles = [f"{degrees(variant.transmission[joint]):.3f}" for joint in joints]
            numbers = [f"{variant.values[name]:.15g}" for name in names]
            rows.writerow([variant.number, *[variant.student for _ in named], *numbers, *angles])
        return out.getvalue()

    def save(self, folder: str | Path, form: str = "html") -> Path:
        """Write ``sheets/``, ``keys/``, ``problems/`` and ``variants.csv``, all or nothing.

        Parameters
        ----------
        folder
            A folder that does not exist yet, or is empty.
        form
            ``html``, ``typ`` or ``pdf``, of sheets and keys.

        Raises
        ------
        InputError
            A folder that holds something, a form that is none.
        UnavailableError
            PDF without the package typst.
        """
        target = free_folder(folder, form)
        width = max(2, len(str(len(self))))
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=f".{target.name}-") as place:
            whole = Path(place, "whole")
            for part in ("sheets", "keys", "problems"):
                (whole / part).mkdir(parents=True)
            for variant in self.variants:
                name = f"{self.name}-{variant.number:0{width}d}"
                variant.sheet.save(whole / "sheets" / f"{name}.{form}")
                variant.key.save(whole / "keys" / f"{name}.{form}")
                text = _file_text(variant.problem)
                (whole / "problems" / f"{name}.toml").write_text(text, encoding="utf-8")
            (whole / "variants.csv").write_text(self.table(), encoding="utf-8")
            whole.chmod(0o755)
            if target.exists():
                target.rmdir()
            shutil.move(whole, target)
        return target


def free_folder(folder: str | Path, form: str) -> Path:
    """Return a folder into which assignments may be written."""
    target = Path(folder)
    if f".{form}" not in ENDINGS:
        raise UnknownName("form", form, [ending[1:] for ending in ENDINGS])
    if target.exists() and not target.is_dir():
        raise InputError("is a file, not a folder", where=str(target))
    if target.is_dir() and any(target.iterdir()):
        raise InputError("holds something already", where=str(target), hint="another folder")
    if not target.parent.is_dir():
        raise InputError("no such folder", where=str(target.parent))
    return target


def _file_text(problem: Problem) -> str:
    """Return the problem file: it needs no other file."""
    text = alone(problem.mechanism, problem.tasks)
    head, _, rest = text.partition("\n")
    words = {"title": problem.title, "source": problem.source}
    lines = [f"{key} = {_quoted(text)}" for key, text in words.items() if text]
    return "\n".join([head, *lines, rest])


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


@public(old="problem vary", several=True)
def assign(
    problem: Source,
    task: Task | str | Sequence[Task | str] | None = None,
    *,
    vary: Mapping[str, Sequence[float | str]],
    count: int | None = None,
    set: Mapping[str, Number] | None = None,
    transmission_angle: float | None = None,
    positions: int = 12,
    pose: int = 1,
    seed: int = 0,
    lang: str = "en",
    students: Sequence[str] = (),
    units: str | Units = SI,
) -> Assignments:
    """Return variants of a problem with round numbers, with sheets and answer keys.

    Each of them assembles in all poses of its tasks, and no transmission angle falls below the
    bound anywhere along them. The same seed gives the same variants.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    vary
        name -> (low, high) or (low, high, step); a suffix of the name is a unit (``a_mm``).
        Values are multiples of the step, by default a round one.
    count
        How many variants; without it 30, or as many as the ranges give.
    task
        A sweep or a task of kind reactions, or several: parts of one sheet. By default the first
        one over an interval.
    set
        Numbers of the problem to change, as of `md.solve`.
    transmission_angle
        Least transmission angle of each dyad [rad]; 30 degrees, 0: none.
    positions, pose
        How many positions the tables have, and the number of the one explained in full.
    seed
        Of the numbers.
    lang
        ``"en"`` or ``"ru"``.
    students
        Names, one variant for each in their order.
    units
        Of all numbers, ``"mm,kN"``; by default as in the file or as drawn, lengths else in mm.

    Returns
    -------
    Assignments
        A sequence of `Assignment`, each with its problem, sheet and key.

    Raises
    ------
    InputError
        A count that is not that of the names, a name or a task twice, a task of another kind,
        ranges that make none, an angle that is none, a mechanism without dyads where a bound is
        asked for.
    UnknownName
        A number, a task or a language that is not there.
    SolveError
        Too few sets of numbers do; the message says what fails and how often.

    Examples
    --------
    >>> ranges = {"crank_mm": (30, 40, 5), "rod_mm": (150, 200, 10)}
    >>> variants = md.assign(md.slider_crank(0.035, 0.18), vary=ranges, count=2, positions=4)
    >>> [dict(variant.values) for variant in variants]
    [{'crank_mm': 30.0, 'rod_mm': 190.0}, {'crank_mm': 35.0, 'rod_mm': 190.0}]
    """
    whole, names = _named(problem, task, set)
    if students:
        count = _counted(students, count)
    wanted, least = (USUAL, 1) if count is None else (count, count)
    _check(wanted, positions, seed, transmission_angle)
    drawn = ranges(whole, vary)
    shown = _units(units, whole, drawn)
    words = Phrases(lang, "assignments", shown), Phrases(lang, "reports", shown), Phrases(lang)
    bare = _with_positions(whole, names, positions)
    solvers = [Solver(with_scene(bare, name), name) for name in names]
    base = [solver().in_units(shown) for solver in solvers]
    if transmission_angle and not any(map(transmission, base)):
        raise InputError("no dyad has a transmission angle", where=f"task {', '.join(names)}")
    bound = ANGLE if transmission_angle is None else transmission_angle
    more = {} if whole.mechanism.dimension == 3 else {"loads": not _loaded_by(whole, drawn)}
    options: dict[str, Any] = {"traces": False, "title": False, "lang": lang, **more}
    exercises: list[Exercise] = []
    for name, result in zip(names, base, strict=True):
        rows = _rows(bare, name, positions)
        if not 0 <= pose < len(rows):
            raise InputError(f"there is no position {pose}", hint=f"from 0 to {len(rows) - 1}")
        start = subject_of(result, rows[pose], words[2])
        diagram = svg_text(plot(result, "diagram", pose=start.pose, **options))
        exercises.append(Exercise(name, rows, pose, diagram))
    found, tried = choose(solvers, drawn, wanted, seed, bound, least)
    writer = _VariantWriter(bare, drawn, exercises, len(found), words, tuple(students))
    return Assignments(whole.name, tuple(map(writer.one, range(1, len(found) + 1), found)), tried)


def _named(
    problem: Source,
    task: Task | str | Sequence[Task | str] | None,
    set: Mapping[str, Number] | None,
) -> tuple[Problem, list[str]]:
    """Return the problem and the names of the tasks of its sheets."""
    several = task if isinstance(task, Sequence) and not isinstance(task, str) else [task]
    first, *others = several or [None]
    whole, named = given(problem, first, set)
    names = [moving_task(whole, named, ends=True)]
    for one in others:
        whole, named = given(whole, one)
        names.append(moving_task(whole, named, ends=True))
    _once(names, "task")
    return whole, names


def _units(units: str | Units, problem: Problem, drawn: Sequence[RoundRange]) -> Units:
    """Return the units of sheets: lengths as names for, drawn or written, else in millimetres."""
    shown = units_of(units, problem.mechanism.units)
    if "m" in units_of(shown.asked).by_si:
        return shown
    by_name = parameter_units(problem.mechanism, problem.tasks.values())
    lengths = [n.unit or "m" for n in drawn if by_name.get(n.base) == "m"]
    lengths += ["mm"] * ("m" not in shown.by_si)
    return units_of((*shown.asked, *lengths[:1]), problem.mechanism.units)


def _loaded_by(problem: Problem, drawn: Sequence[RoundRange]) -> bool:
    """Return whether a number that is drawn tells a load: one diagram stands for all variants."""
    loads = " ".join(map(repr, problem.mechanism.loads.values()))
    return any(re.search(rf"\b{re.escape(number.base)}\b", loads) for number in drawn)


def _counted(students: Sequence[str], count: int | None) -> int:
    """Return how many students there are, each once."""
    _once(students, "students")
    if count not in (None, len(students)):
        raise InputError(f"{len(students)} students, {count} variants", where="count")
    return len(students)


def _once(names: Sequence[str], where: str) -> None:
    twice = [name for k, name in enumerate(names) if name in names[:k]]
    if twice:
        raise InputError(f"'{twice[0]}' stands there twice", where=where)


def _check(count: int, positions: int, seed: int, angle: float | None) -> None:
    for word, value, most in (("count", count, LARGEST), ("positions", positions, MOST)):
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
            raise InputError(f"a whole number from 1 to {most} is needed", where=word)
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise InputError("a whole number, 0 or more, is needed", where="seed")
    if angle is not None and not 0 <= angle < pi / 2:
        raise InputError("an angle from 0 to 90 degrees is needed", where="transmission")


def _with_positions(problem: Problem, names: Sequence[str], positions: int) -> Problem:
    """Return the problem with tasks alone: the positions of the tables, transmission angles."""
    tasks: dict[str, Task] = {}
    for name in names:
        task = problem.tasks[name]
        assert isinstance(task, Sweep)
        changes: Json = {}
        if not any(driver.at is not None for driver in task.all_drivers):
            changes["poses"] = positions + 1
        if problem.mechanism.dimension == 2:
            changes["measures"] = tuple(dict.fromkeys([*(task.measures or ()), "transmission"]))
        tasks[name] = dataclasses.replace(task, **changes)
    return dataclasses.replace(problem, tasks=Table(tasks), expected=(), pattern=None)


def _rows(problem: Problem, name: str, positions: int) -> list[int]:
    task = problem.tasks[name]
    assert isinstance(task, Sweep)
    listed = [len(driver.at) for driver in task.all_drivers if driver.at is not None]
    return list(range(min([positions, *listed])))


@dataclass(frozen=True)
class _VariantWriter:
    """What the documents of all variants share."""

    problem: Problem
    drawn: tuple[RoundRange, ...]
    exercises: Sequence[Exercise]
    count: int
    words: tuple[Phrases, Phrases, Phrases]
    students: tuple[str, ...]

    def one(self, number: int, chosen: Chosen) -> Assignment:
        say, report, _ = self.words
        title = self.problem.title or self.problem.name
        name = say("sheet", title, number)
        problem = dataclasses.replace(self.problem.with_values(chosen.values), title=name)
        answers = answers_of(self.problem, self.exercises, chosen.results, self.words)
        student = self.students[number - 1] if self.students else ""

        def paper(title: str, under: str, sections: tuple[Section, ...]) -> Report:
            by = ", ".join([student] * bool(student) + [under])
            return Report(localised(Document(title, by, sections, say.lang), say.units))

        sheet = sheet_sections(problem, chosen, self.drawn, answers, self.words)
        made = report("computed by", __version__)
        return Assignment(
            number,
            chosen.values,
            problem,
            paper(name, say("of", number, self.count), sheet),
            paper(say("key", title, number), made, key_sections(chosen, self.drawn, answers, say)),
            chosen.transmission,
            student,
        )
