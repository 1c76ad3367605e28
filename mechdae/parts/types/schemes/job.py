"""A task of composition as a job: its pieces in processes, kept on the disk, with progress."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from mechdae import __version__
from mechdae.describe import Problem
from mechdae.describe.file.writing import alone
from mechdae.design.jobs.call import JobCall, Progress, Workers, blamed
from mechdae.design.jobs.log import JobLog
from mechdae.parts.types.described.composition import CompositionDemand, asked_of, bare_crank
from mechdae.parts.types.described.task import Composition
from mechdae.parts.types.schemes.certified_pareto import SchemeFront, front_of
from mechdae.parts.types.schemes.search import Run, SchemeSearch
from mechdae.parts.types.schemes.work_items import FoundSets, SchemePiece, computed
from mechdae.results import Summary, SynthesisResult

FORMAT = 1
LOG = "pieces.jsonl"
OPEN = ("samples", "starts", "grow", "keep", "reference")
"""Keys that may differ in one folder: pieces are known by what they hold."""


def compose(problem: Problem, name: str, call: JobCall) -> SynthesisResult:
    """Return the front of a task of composition: schemes with dimensions that trace its curve."""
    pool = call.pool()
    chosen = call.task_of(problem, name, Composition, _draws)
    open_ = replace(chosen, **dict.fromkeys(OPEN))
    text = alone(replace(bare_crank(), parameters=problem.mechanism.parameters), {name: open_})
    log = nullcontext() if call.out is None else PieceLog(call.out, text, name)
    with blamed(problem, name, ("chains",)), log as record, pool as workers:
        return composed(problem, name, chosen, run=PieceJob(workers, record, call.progress))


def _draws(problem: Problem, task: Composition) -> tuple[int | None, int | None]:
    asked_of(task, problem.mechanism.parameter_values)
    return task.starts, task.seed


def composed(
    problem: Problem, name: str, task: Composition, run: Run | None = None
) -> SynthesisResult:
    began = time.process_time()
    goal = asked_of(task, problem.mechanism.parameter_values)
    search = SchemeSearch(goal, run or PieceJob())
    archive = search.search()
    front = front_of(goal, archive, search.aim, problem.name, problem.title)
    summary: dict[str, object] = {
        "schemes": len(search.tried), "sets": archive.seen,
        "distinct": len(archive.every), "seed": goal.seed,
        "status": "found" if front.designs else "none found",
        "rejected": front.rejected, "dominated": front.dominated,
        "rounds": search.rounds, "radius": search.radius,
        "goal": goal.kind, "error_unit": goal.unit("error"), **_wanted(goal),
        "seconds": {"whole": time.process_time() - began},
    }  # fmt: skip
    if front.designs:
        summary["front"] = front.summary
    return SynthesisResult.of(
        problem, name, task,
        status=np.array(["ok"] * len(front.designs)), summary=Summary(summary),
        fault=_fault(goal, front), data={"designs": front.designs},
    )  # fmt: skip


def _wanted(asked: CompositionDemand) -> dict[str, list[list[float]]]:
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
    """Computes the pieces that the log does not have, round by round."""

    def __init__(
        self, workers: Workers | None = None, log: PieceLog | None = None,
        progress: Progress | None = None,
    ) -> None:  # fmt: skip
        self._workers, self._log, self._progress = workers or Workers(), log, progress
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

        def take(k: int, sets: FoundSets) -> None:
            if k in found:
                return
            if self._log is not None:
                self._log.put(pieces[k], sets)
            found[k] = self._known[known[k]] = sets
            self._done += 1
            if pieces[k].do == "refine" and len(sets.error):
                least = float(sets.error.min()) * pieces[k].aim.unit
                self._best = least if self._best is None else min(self._best, least)
            if self._progress is not None:
                self._progress(self._done, self._total, self._best)

        for k, digest in known.items():
            if digest in self._known:
                take(k, self._known[digest])
        missing = {k: piece for k, piece in enumerate(pieces) if k not in found}
        self._workers.compute(missing, take, computed, "piece")
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
        return {digest: self._found[digest] for digest in digests if digest in self._found}

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
            if any(len(row) != len(places) for row in rows.values()):
                return
            self._found.setdefault(str(entry["piece"]), FoundSets(places, **rows))
        except (ValueError, KeyError, TypeError):
            return


MEASURES = tuple(field.name for field in fields(FoundSets) if field.name != "places")


def _plain(found: FoundSets) -> dict[str, list[float] | int]:
    flat = np.stack([found.places.real, found.places.imag], axis=-1).ravel()
    rows = {name: getattr(found, name).tolist() for name in MEASURES}
    return {"points": int(found.places.shape[1]), "places": flat.tolist(), **rows}
