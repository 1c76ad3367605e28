"""One start of a synthesis as it is sent to another process and computed there.

The message is small and plain, so that any executor can carry it: the problem as the text of
a problem file, the name of the task, the values of the start. A process builds the NLP of each
class once and keeps it. This module loads casadi only when a start is solved.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from mechdae.describe.file.problem import Problem
from mechdae.describe.file.writing import alone
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.tasks.synthesis import Synthesis
from mechdae.design.jobs.distribute import elsewhere
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.design.synthesis.exact.complete import PathWork
    from mechdae.design.synthesis.ipopt import Optimum
    from mechdae.design.synthesis.nlp import Nlp
    from mechdae.types import Floats

KEPT = 4
"""Problems whose NLPs a process keeps."""


@dataclass(frozen=True)
class Work:
    """A start as it is sent: ``kind`` is the place of its class among those of the search."""

    version: str
    text: str
    task: str
    kind: int
    values: Mapping[str, Any]
    given: dict[str, Floats | float]


def text_of(problem: Problem, name: str, task: Synthesis) -> str:
    """Return a problem file with all that determines the starts of a task but their number."""
    goals = repr((task.goal, task.goals, task.objectives, task.constraints))
    tasks: dict[str, Task] = {
        key: other
        for key, other in problem.tasks.items()
        if re.search(rf"""['"]{re.escape(key)}['"/]""", goals)
    }
    return alone(problem.mechanism, {**tasks, name: replace(task, starts=None)})


def followed(work: PathWork) -> Any:
    """Return where paths lead to, or a `Failure`; runs in any process that has the same mechdae."""
    from mechdae.design.synthesis.exact.complete import followed as ends

    return elsewhere(work.version, lambda: ends(work))


def solved(work: Work) -> Any:
    """Return the optimum of a start; runs in any process that has the same mechdae."""
    return elsewhere(work.version, lambda: _solved(work))


def _solved(work: Work) -> Optimum:
    from mechdae.design.synthesis.ipopt import ALONE

    with ALONE:
        nlp = _built(work.text, work.task)(work.kind)
        return nlp.solve(nlp.point(work.values), work.given)


class _Classes:
    """The NLPs of a task by the place of their class, each built when it is first needed."""

    def __init__(self, text: str, name: str) -> None:
        import tomllib

        from mechdae.describe.file.load import from_dict
        from mechdae.design.synthesis.search import Search

        problem = from_dict(tomllib.loads(text))
        task = problem.tasks[name]
        assert isinstance(task, Synthesis)
        self._search = Search(problem, task)
        self._found: dict[int, Nlp] = {}

    def __call__(self, kind: int) -> Nlp:
        if kind not in self._found:
            self._found[kind] = self._search.build(self._search.kinds[kind])
        return self._found[kind]


@lru_cache(maxsize=KEPT)
def _built(text: str, name: str) -> _Classes:
    return _Classes(text, name)
