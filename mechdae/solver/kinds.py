"""The kinds of tasks of one mechanism: what computes, shows and tries each of them."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from typing import Any

from mechdae.records import dataclass


@dataclass(frozen=True)
class TaskKind:
    """A kind of task; functions are named ``module:function`` and loaded when they are used.

    Parameters
    ----------
    run
        Computes a `Result` of a problem, the name of the task and the task.
    show
        Says what the task will build, for `mechdae show`: of problem, task and model.
    trial
        Raises for what would stop the task, for `mechdae check`: of problem and task; the same
        as ``run`` where only that tells.
    spread
        Whether it consists of many computations, which take ``workers`` and ``progress``.
    design
        Looks for designs as a job: of problem and task, with the options of `md.synthesize`.
    log
        Name of the file with what such a job has finished.
    """

    run: str
    show: str = ""
    trial: str = ""
    spread: bool = False
    design: str = ""
    log: str = ""


KINDS: Mapping[str, TaskKind] = {
    "sweep": TaskKind(
        "mechdae.motion.kinematics.sweep:sweep",
        show="mechdae.motion.kinematics.show:driven_structure",
        trial="mechdae.motion.kinematics.show:tried",
    ),
    "modes": TaskKind(
        "mechdae.motion.kinematics.modes_task:modes",
        show="mechdae.motion.kinematics.show:driven_structure",
        trial="mechdae.motion.kinematics.modes_task:modes",
    ),
    "reactions": TaskKind(
        "mechdae.forces.task:reactions", show="mechdae.forces.show:reactions_structure"
    ),
    "motion": TaskKind(
        "mechdae.dynamics.task:motion",
        show="mechdae.dynamics.show:motion_structure",
        trial="mechdae.dynamics.show:tried",
    ),
    "equilibrium": TaskKind(
        "mechdae.dynamics.rest.equilibrium:equilibrium",
        show="mechdae.dynamics.show:motion_structure",
        trial="mechdae.dynamics.show:tried",
    ),
}
"""Kind of task -> its functions."""


def function(text: str) -> Callable[..., Any]:
    """Return the function that is named ``module:function``."""
    module, name = text.split(":")
    loaded: Callable[..., Any] = getattr(importlib.import_module(module), name)
    return loaded
