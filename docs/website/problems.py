"""A page for each predefined problem: live page, diagram, curves, structure, results, file."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import os
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import mechdae as md
from mechdae.cli import main
from mechdae.describe.file import library
from mechdae.draw.figure import svg_text
from mechdae.errors import MechdaeError

SHOWN = ("sweep", "reactions", "motion", "equilibrium")
"""Kinds of tasks that are solved for a page, in each problem the first one."""
WORKERS = min(4, max(2, os.cpu_count() or 2))
HEAVY = {"bricard", "stewart-gough"}
"""Problems that take seconds: pages have the start of their sweep, and say how to go on."""
KINDS = {
    "Motion of linkages": "sweep",
    "Forces and friction": "reactions",
    "Motion under forces, equilibria": "motion equilibrium",
    "Synthesis": "synthesis",
    "Mechanisms in space": "space",
}
"""Groups of the contents; a problem stands in the last one that has a kind of its tasks."""


def write(target: Path, names: list[str] | None = None, workers: int = WORKERS) -> list[str]:
    """Write the pages into ``problems/`` and return their names for the contents.

    Live pages go to ``_live/live/``, from where they are copied as they are.
    """
    folder, live = target / "problems", target / "_live" / "live"
    folder.mkdir(parents=True, exist_ok=True)
    live.mkdir(parents=True, exist_ok=True)
    chosen = sorted(library.names() if names is None else names)
    jobs = [(name, folder, live) for name in chosen]
    if workers > 1:
        jobs.sort(key=lambda job: job[0] not in HEAVY)  # long ones first
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            entries = sorted(pool.map(_page, jobs, chunksize=1))
    else:
        entries = [_page(job) for job in jobs]
    lines = ["# Predefined problems", "", "Each is a name for the commands: `mechdae solve NAME`."]
    for caption in KINDS:
        own = [(name, title) for name, title, group in entries if group == caption]
        if own:
            lines += ["", f"## {caption}", "", "| problem | is |", "|---|---|"]
            lines += [f"| [{name}]({name}.md) | {_cell(title)} |" for name, title in own]
    (folder / "index.md").write_text("\n".join([*lines, ""]), encoding="utf-8")
    return ["problems/index.md"]


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;").replace("[", "\\[")


def _page(job: tuple[str, Path, Path]) -> tuple[str, str, str]:
    """Write the page of one problem; return its name, title and group."""
    name, folder, live = job
    problem = md.load(name)
    # not in the contents, which would stand at the side of every page: the index links to it
    lines = ["---", "orphan: true", "---", "", f"# {_cell(problem.title or name)}", "", f"`{name}`"]
    if problem.source:
        lines[-1] += f". Source: {_cell(problem.source)}."
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        task, result = _solved(problem)
        lines += _live(problem, task, live)
        if result is not None:
            lines += _pictures(name, task, result, folder)
        lines += ["", "## Structure", "", *_printed("show", name)]
        if result is not None and task and name not in HEAVY:
            lines += [
                "", f"## Task `{task}`", "", "```text", f"$ mechdae solve {name} --task {task}",
                str(result).rstrip(), "```",
            ]  # fmt: skip
    text = library.find(name).read_text(encoding="utf-8").rstrip()
    lines += ["", "## Problem file", "", "```toml", text, "```", ""]
    (folder / f"{name}.md").write_text("\n".join(lines), encoding="utf-8")
    return name, problem.title or name, _group(problem)


def _group(problem: Any) -> str:
    if problem.mechanism.dimension == 3:
        return "Mechanisms in space"
    kinds = {task.kind for task in problem.tasks.values()}
    found = [caption for caption, words in KINDS.items() if kinds & set(words.split())]
    return found[-1] if found else next(iter(KINDS))


def _solved(problem: Any) -> tuple[str, Any]:
    """Return the first task that is shown, and its result; "" where it is made for the diagram."""
    for name, task in problem.tasks.items():
        if task.kind in SHOWN and problem.name in HEAVY:
            return name, md.solve(problem.mechanism, _start(task))
        if task.kind in SHOWN:
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


def _start(task: Any) -> Any:
    """Return a sweep of the first pose of another one."""
    drivers = [
        dataclasses.replace(
            own, at=(own.from_ if own.at is None else own.at[0],), from_=None, to=None
        )
        for own in task.all_drivers
    ]
    return md.Sweep(drivers=tuple(drivers))


def _pictures(name: str, task: str, result: Any, folder: Path) -> Iterator[str]:
    """Yield the lines of diagram and curves, which are written beside the page."""
    words = "Kinematic diagram" if task else "The mechanism with the numbers of its sketch"
    kinds = [("diagram", words), *([("curves", "Curves")] if task and name not in HEAVY else [])]
    for kind, alt in kinds:
        with contextlib.suppress(MechdaeError):
            text = svg_text(md.plot(result, kind))
            (folder / f"{name}-{kind}.svg").write_text(text, encoding="utf-8")
            yield ""
            yield f"![{alt}]({name}-{kind}.svg)"


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
    head = ["", "## Live page", ""]
    if name in HEAVY:
        return [*head, f"`mechdae solve {name}` and `mechdae page {name}` take some seconds."]
    try:
        md.page(problem, task).save(live / f"{name}.html")
    except MechdaeError:
        return []
    place = f"../live/{name}.html"
    return [
        *head,
        f'<p><a href="{place}">alone in the window</a>, or made by '
        f"<code>mechdae page {name} --task {task}</code></p>",
        f'<iframe class="live" loading="lazy" src="{place}" title="live page of {name}"></iframe>',
    ]
