"""The kinds of tasks beside sweeps, which load none of this."""

from __future__ import annotations

from mechdae.additions import Adds, TaskKind

CLASSES, TABLES = "mechdae.describe.tasks", "mechdae.results.tables"
SHOW = "mechdae.dynamics.show:motion_structure"
TRIED = "mechdae.dynamics.show:tried"
MODES = "mechdae.motion.kinematics.modes_task:modes"
ADDS: Adds = {"tasks": {
    "modes": TaskKind(
        f"{CLASSES}.kinds:Modes", run=MODES, show="mechdae.motion.kinematics.show:driven_structure",
        trial=MODES, text=f"{TABLES}.modes:MODES",
    ),
    "reactions": TaskKind(
        f"{CLASSES}.motion:Reactions", run="mechdae.forces.task:reactions",
        show="mechdae.forces.show:reactions_structure",
    ),
    "motion": TaskKind(
        f"{CLASSES}.motion:Motion", run="mechdae.dynamics.task:motion",
        show=SHOW, trial=TRIED, text=f"{TABLES}.motions:MOTION",
    ),
    "equilibrium": TaskKind(
        f"{CLASSES}.motion:Equilibrium", run="mechdae.dynamics.rest.equilibrium:equilibrium",
        show=SHOW, trial=TRIED, text=f"{TABLES}.motions:EQUILIBRIUM",
    ),
    "synthesis": TaskKind(
        f"{CLASSES}.synthesis:Synthesis", run="mechdae.design.synthesis.pareto:synthesized",
        show="mechdae.tasks.show:design_structure", text=f"{TABLES}.designs:SYNTHESIS",
        design="mechdae.design.synthesis.job.run:synthesize", log="starts.jsonl",
    ),
    "study": TaskKind(
        f"{CLASSES}.studies:Study", run="mechdae.design.studies.parameter_study:study",
        text=f"{TABLES}.modes:STUDY", spread=True,
    ),
    "sensitivity": TaskKind(
        f"{CLASSES}.studies:Sensitivity", run="mechdae.design.studies.sensitivity:sensitivity",
    ),
}}  # fmt: skip
