"""A page for each predefined problem: live page, curves, structure, results, file."""

from __future__ import annotations

import contextlib
import io
import os
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from html import escape
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import mechdae as md
from mechdae.cli import main
from mechdae.describe.file import library
from mechdae.draw.figure import svg_text
from mechdae.errors import MechdaeError
from website import cards, thumbs

SHOWN = ("sweep", "reactions", "motion", "equilibrium")
"""Kinds of tasks that are solved for a page, in each problem the one with the longest way."""
WORKERS = max(2, min(4, os.cpu_count() or 2))
KINDS = {
    "Motion of linkages": "sweep",
    "Forces and friction": "reactions",
    "Motion under forces, equilibria": "motion equilibrium",
    "Synthesis": "synthesis composition",
}
"""Kinds of problems; each has the last one with a kind of its tasks."""


def write(target: Path, names: list[str] | None = None, workers: int = WORKERS) -> list[str]:
    """Write the pages into ``problems/`` and return their names for the contents.

    Live pages go to ``_live/live/`` and small pictures to ``_live/small/``, from where they are
    copied as they are.
    """
    for folder in ("problems", "_live/live", "_live/small"):
        (target / folder).mkdir(parents=True, exist_ok=True)
    chosen = sorted(library.names() if names is None else names)
    jobs = [(name, target) for name in chosen]
    if workers > 1:
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            listed = list(pool.map(_page, jobs, chunksize=1))
    else:
        listed = [_page(job) for job in jobs]
    text = "# Predefined problems\n\nEach is a name for the commands: `mechdae solve NAME`.\n\n"
    (target / "problems/index.md").write_text(text + cards.grid(listed), encoding="utf-8")
    return ["problems/index.md"]


def _cell(text: str) -> str:
    return text.replace("<", "&lt;").replace("[", "\\[")


def _page(job: tuple[str, Path]) -> cards.Card:
    """Write the page of one problem; return its card."""
    name, target = job
    problem = md.load(name)
    # not in the contents, which would stand at the side of every page: the index links to it
    lines = ["---", "orphan: true", "---", "", f"# {_cell(problem.title or name)}", "", f"`{name}`"]
    if problem.source:
        lines[-1] += f". Source: {_cell(problem.source)}."
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        task, result = _solved(problem)
        live = _live(problem, task, target / "_live/live")
        lines += live
        small, moves = f"small/{name}.svg", False
        if result is not None:
            moves = thumbs.write(result, target / "_live" / small)
            kinds = [*(["curves"] if task else []), *([] if live else ["diagram"])]
            lines += _pictures(name, task, result, kinds, target / "problems")
        lines += _folded("Structure", _printed("show", name))
        if result is not None and task:
            shown = f"$ mechdae solve {name} --task {task}\n{str(result).rstrip()}"
            lines += _folded(f"Numbers of task {task}", ["```text", shown, "```"])
    text = library.find(name).read_text(encoding="utf-8").rstrip()
    lines += [*_folded("Problem file", ["```toml", text, "```"]), ""]
    (target / f"problems/{name}.md").write_text("\n".join(lines), encoding="utf-8")
    return _card(problem, "" if result is None else f"../{small}", moves)


def _folded(title: str, lines: list[str]) -> list[str]:
    return ["", f"<details><summary>{escape(title)}</summary>", "", *lines, "", "</details>"]


def _card(problem: Any, picture: str, moves: bool) -> cards.Card:
    tasks = list(dict.fromkeys(task.kind for task in problem.tasks.values()))
    kinds = [kind for kind, words in KINDS.items() if set(words.split()) & set(tasks)]
    facets = {
        "kind": kinds[-1:],
        "shows": tasks,
        **cards.facets_of([problem.mechanism]),
    }
    title = problem.title or problem.name
    return cards.Card(f"{problem.name}.html", title, problem.name, picture, moves, facets)


def _solved(problem: Any) -> tuple[str, Any]:
    """Return the task that is shown and its result; "" where it is made for the diagram."""
    able = [name for name, task in problem.tasks.items() if task.kind in SHOWN]
    if able:
        name = max(able, key=lambda name: problem.tasks[name].way)
        return name, md.solve(problem, name)
    for task in problem.tasks.values():
        if task.kind == "synthesis" and task.driver is not None:
            name = task.driver.coordinate.partition(".")[0]
            joint = problem.mechanism.joints.get(name)
            crank = joint.second_body if joint is not None else name
            driver = md.Driver(f"{crank}.angle", range="assembled")
            with contextlib.suppress(MechdaeError):
                return "", md.solve(problem.mechanism, md.Sweep(driver=driver, poses=73))
    return "", None


def _pictures(name: str, task: str, result: Any, kinds: list[str], folder: Path) -> Iterator[str]:
    """Yield the lines of the pictures, which are written beside the page."""
    words = {"curves": f"Curves of task {task}", "diagram": "Kinematic diagram"}
    for kind in kinds:
        with contextlib.suppress(MechdaeError):
            text = svg_text(md.plot(result, kind))
            (folder / f"{name}-{kind}.svg").write_text(text, encoding="utf-8")
            yield from ("", f"![{words[kind]}]({name}-{kind}.svg)")


def _printed(command: str, name: str) -> list[str]:
    """Return what a command prints, as a block."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        main([command, name])
    return ["```text", f"$ mechdae {command} {name}", out.getvalue().rstrip(), "```"]


def _live(problem: Any, task: str, live: Path) -> list[str]:
    """Return the lines that show the live page, which is written beside; none where it has none."""
    name = problem.name
    if not task:
        return []
    try:
        md.page(problem, task).save(live / f"{name}.html")
    except MechdaeError:
        return []
    return ["", cards.frame(f"../live/{name}.html", problem.title or name)]
