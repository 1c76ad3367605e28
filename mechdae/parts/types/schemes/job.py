"""A task of composition as a job: its pieces in processes, kept on the disk, with progress."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from mechdae import __version__
from mechdae.describe import Mechanism, Problem, load
from mechdae.describe.file.writing import alone
from mechdae.design.jobs.distribute import Failure, distribute
from mechdae.design.jobs.executors import Borrowed, Processes, Supply
from mechdae.design.jobs.log import JobLog
from mechdae.errors import InputError, MechdaeError
from mechdae.parts.types.described.composition import CompositionDemand, asked_of, bare_crank
from mechdae.parts.types.described.task import Composition
from mechdae.parts.types.schemes.certified_pareto import SchemeFront, front_of
from mechdae.parts.types.schemes.search import Run, SchemeSearch
from mechdae.parts.types.schemes.work_items import FoundSets, SchemePiece, computed
from mechdae.results import Summary, SynthesisResult

FORMAT = 1
LOG = "pieces.jsonl"
AHEAD = 2
"""Pieces that are handed over for each worker."""
OPEN = ("samples", "starts", "grow", "keep", "reference")
"""Keys that may differ in one folder: pieces are known by what they hold."""
Progress = Callable[[int, int, float | None], None]


def compose(
    problem: Problem | Mechanism | str | Path,
    task: Composition | str | None = None,
    *,
    starts: int | None = None,
    seed: int | None = None,
    workers: int = 1,
    executor: Executor | None = None,
    out: str | Path | None = None,
    progress: Progress | None = None,
    paths: Callable[[int, int], None] | None = None,
) -> SynthesisResult:
    """Return the front of a task of composition: schemes with dimensions that trace its curve.

    The answer depends on the task alone: not on where pieces are computed, nor on whether the job
    was broken off and begun again.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, or a file.
    task
        Name of a task (default: the first of kind composition), or a task as a value.
    starts, seed
        In place of the task's own.
    workers
        Processes of this machine; 1: this one.
    executor
        Computes the pieces in place of own processes; it is not shut down.
    out
        Folder with the log of finished pieces, ``pieces.jsonl``: a job that was broken off goes on
        there.
    progress
        Called with the number of finished pieces, of those known so far, and the least error.

    paths
        Not called: no paths are followed.

    Raises
    ------
    InputError
        Something in the description or the call is wrong; the folder is of another job.
    SolveError
        A piece could not be computed: its worker died again and again.
    """
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise InputError("a whole number above 0 is needed", where="workers")
    if executor is not None and workers != 1:
        raise InputError("'workers' and 'executor' are given, one is needed", where="executor")
    whole, name, chosen = _chosen(problem, task, starts, seed)
    kept = replace(chosen, **dict.fromkeys(OPEN))
    text = alone(_parameters(whole), {name: kept})
    try:
        with (
            nullcontext() if out is None else PieceLog(out, text, name) as log,
            _supply(workers, executor) or nullcontext() as supply,
        ):
            window = None if executor is not None else AHEAD * workers
            return composed(whole, name, chosen, run=PieceJob(supply, window, log, progress))
    except MechdaeError as error:
        if isinstance(error, InputError) and error.where.startswith("chains"):
            error.inside(f"tasks.{name}")
        whole.blame(error)
        raise


def composed(
    problem: Problem, name: str, task: Composition, run: Run | None = None
) -> SynthesisResult:
    """Return the result of a task of composition.

    Parameters
    ----------
    run
        Computes pieces, in their order; None: here, one after the other.
    """
    began = time.process_time()
    asked = asked_of(task, problem.mechanism.parameter_values)
    search = SchemeSearch(asked, run or PieceJob(None, None, None, None))
    archive = search.search()
    front = front_of(asked, archive, search.aim, problem.name, problem.title)
    summary: dict[str, Any] = {
        "schemes": len(search.tried), "sets": archive.seen,
        "distinct": len(archive.every), "seed": asked.seed,
        "status": "found" if front.designs else "none found",
        "rejected": front.rejected, "dominated": front.dominated,
        "rounds": search.rounds, "radius": search.radius,
        "goal": asked.kind, "error_unit": asked.unit("error"), **_wanted(asked),
        "seconds": {"whole": time.process_time() - began},
    }  # fmt: skip
    if front.designs:
        summary["front"] = front.summary
    return SynthesisResult(
        problem.name, name, task.kind, problem.mechanism, problem.title,
        status=np.array(["ok"] * len(front.designs)), summary=Summary(summary),
        fault=_fault(asked, front), definition=task, data={"designs": front.designs},
    )  # fmt: skip


def _wanted(asked: CompositionDemand) -> dict[str, Any]:
    """Return what the summary says of the goal."""
    if asked.visits is not None:
        return {"targets": [list(row) for row in asked.visits.targets]}
    if asked.function is None:
        return {"curve": [list(corner) for corner in asked.corners]}
    first, start = asked.function.input_start or 0.0, asked.function.output_start or 0.0
    rows = zip(asked.function.inputs, asked.function.outputs, strict=True)
    return {"function": [[first + x, start + y] for x, y in rows]}


def _fault(asked: CompositionDemand, front: SchemeFront) -> str | None:
    """Return why there is no design."""
    if front.designs:
        return None
    missed = [
        f"{name} = {limit:g}: the best found is {front.nearest[name]:.4g}"
        for name, limit in asked.within.items()
        if name in front.nearest
    ]
    if front.rejected:
        reason = front.rejected[0]["reasons"][0]
        return f"no scheme passed its certificate ({len(front.rejected)} tried: {reason})"
    words = f" ({'; '.join(missed)})" if missed else ""
    return (
        f"no scheme of the chains allowed was found within the limits{words}; "
        "a search, no proof that there is none"
    )


class PieceJob:
    """Computes the pieces that the log does not have, round by round.

    Parameters
    ----------
    supply
        Of the pool; None: this process.
    window
        Most pieces that are handed to the pool at a time; None: all.
    """

    def __init__(
        self, supply: Supply | None, window: int | None, log: PieceLog | None,
        progress: Progress | None,
    ) -> None:  # fmt: skip
        self._supply, self._window, self._log, self._progress = supply, window, log, progress
        self._done = self._total = 0
        self._best: float | None = None
        self._known: dict[str, FoundSets] = {}

    def __call__(self, pieces: Sequence[SchemePiece]) -> list[FoundSets]:
        """Return what the pieces give, in their order."""
        found: dict[int, FoundSets] = {}
        self._total += len(pieces)
        if self._log is not None:
            self._known |= self._log.known(pieces)
        known = {k: piece.digest for k, piece in enumerate(pieces)}

        def take(k: int, own: FoundSets) -> None:
            if k in found:
                return
            if self._log is not None:
                self._log.put(pieces[k], own)
            found[k] = self._known[known[k]] = own
            self._done += 1
            if pieces[k].do == "refine" and len(own.error):
                least = float(own.error.min()) * pieces[k].aim.unit
                self._best = least if self._best is None else min(self._best, least)
            if self._progress is not None:
                self._progress(self._done, self._total, self._best)

        for k, digest in known.items():
            if digest in self._known:
                take(k, self._known[digest])
        missing = [k for k in range(len(pieces)) if k not in found]
        if self._supply is None:
            for k in missing:
                outcome = computed(pieces[k])
                if isinstance(outcome, Failure):
                    from mechdae.errors import SolveError

                    raise SolveError(f"piece {k}: {outcome.what}\n{outcome.trace.strip()}")
                take(k, outcome)
        elif missing:
            works = {k: pieces[k] for k in missing}
            distribute(works, self._supply, take, self._window, computed, "piece")
        return [found[k] for k in range(len(pieces))]


class PieceLog(JobLog):
    """The log in a folder, held by one process at a time: a line for each finished piece."""

    def __init__(self, folder: str | Path, text: str, task: str) -> None:
        head = {
            "format": FORMAT, "mechdae": __version__, "numpy": np.__version__, "task": task,
            "problem": text,
        }  # fmt: skip
        self._found: dict[str, FoundSets] = {}
        super().__init__(Path(folder) / LOG, head)
        for entry in self.entries:
            self._enter(entry)
        self.begin()

    def known(self, pieces: Sequence[SchemePiece]) -> dict[str, FoundSets]:
        """Return what is finished of some pieces, by their digests."""
        digests = [piece.digest for piece in pieces]
        return {own: self._found[own] for own in digests if own in self._found}

    def put(self, piece: SchemePiece, found: FoundSets) -> None:
        """Write a finished piece."""
        digest = piece.digest
        if digest not in self._found:
            self.add({"piece": digest, **_plain(found)})
            self._found[digest] = found

    def _enter(self, entry: Mapping[str, Any]) -> None:
        """Take a finished piece; what cannot be read is computed again."""
        try:
            size = int(entry["points"])
            flat = np.array(entry["places"], float)
            places = flat.view(complex).reshape(-1, size)  # keeps the sign of zeros
            rows = {name: np.array(entry[name], float) for name in MEASURES}
            if any(len(own) != len(places) for own in rows.values()):
                return
            self._found.setdefault(str(entry["piece"]), FoundSets(places, **rows))
        except (ValueError, KeyError, TypeError):
            return


MEASURES = tuple(own.name for own in fields(FoundSets) if own.name != "places")


def _plain(found: FoundSets) -> dict[str, Any]:
    flat = np.stack([found.places.real, found.places.imag], axis=-1).ravel()
    rows = {name: getattr(found, name).tolist() for name in MEASURES}
    return {"points": int(found.places.shape[1]), "places": flat.tolist(), **rows}


def _parameters(problem: Problem) -> Mechanism:
    """Return a mechanism with nothing but the parameters that the task may name."""
    return replace(bare_crank(), parameters=problem.mechanism.parameters)


def _supply(workers: int, executor: Executor | None) -> Supply | None:
    if executor is not None:
        return Supply(lambda: Borrowed(executor))
    return Supply(lambda: Processes(workers)) if workers > 1 else None


def _chosen(
    problem: Problem | Mechanism | str | Path, task: Composition | str | None,
    starts: int | None, seed: int | None,
) -> tuple[Problem, str, Composition]:  # fmt: skip
    """Return a problem, the name of its task, and the task, its keys checked."""
    if isinstance(problem, Mechanism):
        problem = Problem(problem)
    whole = problem if isinstance(problem, Problem) else load(problem)
    if isinstance(task, Composition):
        name = next((n for n, known in whole.tasks.items() if known == task), "composition")
        whole = whole.with_task(name, task)
    elif task is None:
        names = [n for n, own in whole.tasks.items() if isinstance(own, Composition)]
        if not names:
            raise InputError("no task of kind composition", where=f"{whole.name}: tasks")
        name = names[0]
    else:
        name = task
        whole.task(task)
    own = whole.tasks[name]
    assert isinstance(own, Composition)
    for word, value, least in (("starts", starts, 1), ("seed", seed, 0)):
        if value is not None and (isinstance(value, bool) or int(value) != value or value < least):
            raise InputError(f"a whole number, {least} or more, is needed", where=word)
    own = replace(
        own, starts=own.starts if starts is None else starts,
        seed=own.seed if seed is None else seed,
    )  # fmt: skip
    try:
        asked_of(own, whole.mechanism.parameter_values)
    except MechdaeError as error:
        error.inside(f"tasks.{name}")
        whole.blame(error)
        raise
    return whole, name, own
