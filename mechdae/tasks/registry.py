"""All kinds of tasks that are computed: of one mechanism, above them, and of parts."""

from __future__ import annotations

from mechdae.additions import Registry
from mechdae.tasks.dispatch.solve import KINDS as OF_ONE_MECHANISM
from mechdae.tasks.dispatch.solve import TaskKind

KINDS: Registry[TaskKind] = Registry(
    "task functions",
    {
        **OF_ONE_MECHANISM,
        "study": TaskKind("mechdae.design.studies.parameter_study:study", spread=True),
        "sensitivity": TaskKind("mechdae.design.studies.sensitivity:sensitivity"),
        "synthesis": TaskKind(
            "mechdae.design.synthesis.pareto:synthesized",
            show="mechdae.tasks.show:design_structure",
            design="mechdae.design.synthesis.job.run:synthesize",
            log="starts.jsonl",
        ),
    },
)
"""Kind of task -> its functions."""
