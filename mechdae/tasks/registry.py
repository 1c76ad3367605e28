"""All kinds of tasks that are computed: those of one mechanism, and those above them."""

from __future__ import annotations

from collections.abc import Mapping

from mechdae.solver.kinds import KINDS as OF_ONE_MECHANISM
from mechdae.solver.kinds import TaskKind

KINDS: Mapping[str, TaskKind] = {
    **OF_ONE_MECHANISM,
    "study": TaskKind("mechdae.studies.study:study", spread=True),
    "sensitivity": TaskKind("mechdae.studies.sensitivity:sensitivity"),
    "synthesis": TaskKind(
        "mechdae.synthesis.front:synthesized", show="mechdae.tasks.show:design_structure"
    ),
    "composition": TaskKind(
        "mechdae.schemes.job:composed", show="mechdae.tasks.show:scheme_structure"
    ),
}
"""Kind of task -> its functions."""
