"""Mechanisms from symbolic constraints: poses, assembly modes, velocities, accelerations.

Names are imported when they are first used, so that ``import mechdae`` stays light.
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.25.0"

PARTS = (
    "mechdae.tasks",
    "mechdae.parts.page", "mechdae.parts.paper", "mechdae.parts.exchange", "mechdae.parts.types",
    "mechdae.parts.proof", "mechdae.parts.play", "mechdae.parts.bench",
)  # fmt: skip
"""Packages that add commands, kinds of tasks and pictures, see `mechdae.additions`."""

CASES = {
    "mechdae.equations.tree": "", "mechdae.equations.cases": "on_curve",
    "mechdae.motion.cases.curves": "on_curve", "mechdae.motion.cases.larger_groups": "",
    "mechdae.motion.cases.space": "", "mechdae.motion.cases.superfluous": "",
    "mechdae.motion.cases.meshes": "meshes", "mechdae.motion.cases.hard_steps": "",
    "mechdae.motion.cases.many": "", "mechdae.motion.cases.laws": "",
    "mechdae.forces.teeth": "meshes", "mechdae.forces.one_sided": "one_sided",
    "mechdae.forces.wear": "face_width",
    "mechdae.motion.cases.stops": "limits", "mechdae.dynamics.contacts": "restitution",
}  # fmt: skip
"""Packages for what only some mechanisms have, in the order in which they are asked, and the
trait of joints that they are about, "" where it is no joint's."""

_HOMES = {
    "mechdae.errors": "MechdaeError InputError ProblemFileError MechanismError UnknownName "
    "UnavailableError SolveError AssemblyError IndeterminateFrictionError "
    "InconsistentStartError InfeasibleMotionError SingularMassError",
    "mechdae.describe.mechanism": "Mechanism Ground Body",
    "mechdae.describe.joints.pairs": "Revolute Prismatic PinInSlot Weld Distance",
    "mechdae.describe.joints.wheels": "Gear Rack Belt FrictionWheel",
    "mechdae.describe.joints.curve": "Curve",
    "mechdae.describe.vectors.values": "Vector Node",
    "mechdae.describe.vectors.expand": "from_loops",
    "mechdae.describe.vectors.loops_of": "loops_of",
    "mechdae.describe.joints.spatial": "SpatialRevolute SpatialPrismatic Cylindrical Spherical "
    "Universal PlanarPair Screw SpatialWeld SpatialGear SpatialRack",
    "mechdae.numerics.homotopy.platforms": "platform_poses",
    "mechdae.numerics.arms.chain": "Arm",
    "mechdae.numerics.arms.poses": "arm_poses",
    "mechdae.describe.loads": "Force Torque Resistance Spring TableLoad TimeTable",
    "mechdae.describe.tasks.kinds": "Driver Sweep Modes",
    "mechdae.describe.tasks.motion": "Reactions Motion Equilibrium",
    "mechdae.describe.tasks.synthesis": "Synthesis",
    "mechdae.describe.tasks.studies": "Study Sensitivity",
    "mechdae.parts.types.described.task": "Composition CurveGoal",
    "mechdae.parts.play.task": "Play",
    "mechdae.describe.file.problem": "Problem Expected",
    "mechdae.describe.file.load": "load",
    "mechdae.describe.file.library": "new",
    "mechdae.describe.file.writing": "dump dumps",
    "mechdae.tasks.solve": "solve",
    "mechdae.tasks.solver": "Solver",
    "mechdae.tasks.parameter_studies": "study screen",
    "mechdae.design.derivatives.function": "function",
    "mechdae.motion.cases.open.open_mechanism": "open_pose",
    "mechdae.tasks.designing": "synthesize",
    "mechdae.results": "Result SweepResult ModesResult ReactionsResult MotionResult "
    "EquilibriumResult StudyResult SensitivityResult SynthesisResult Status",
    "mechdae.tasks.export.folder": "read save StoredResults",
    "mechdae.draw": "plot",
    "mechdae.parts.models.factories": "four_bar slider_crank inverted_slider_crank five_bar watt "
    "stephenson rssr cylinder",
    "mechdae.parts.models.builder": "DrawnMechanism build",
    "mechdae.parts.page": "Page page",
    "mechdae.parts.proof": "certify check_certificate",
    "mechdae.parts.paper.explanations": "Explanation explain",
    "mechdae.parts.paper.reports": "Report report",
    "mechdae.parts.paper.assignments": "Assignment Assignments assign",
    "mechdae.parts.exchange": "Exported export read_drawing",
    "mechdae.parts.exchange.robots.arm_of_urdf": "arm_from_urdf",
    "mechdae.parts.types.chains.chains": "KinematicChain chains count_chains assur_groups",
    "mechdae.parts.types.chains.mechanisms": "mechanism_of problem_of",
    "mechdae.parts.types.chains.variants.scheme": "Variant",
    "mechdae.parts.types.ranking.variants": "variants count_variants",
    "mechdae.parts.types.ranking.rank": "rank Ranking",
    "mechdae.parts.types.ranking.judges": "judged Judgment",
}
_HOME = {name: module for module, names in _HOMES.items() for name in names.split()}
__all__ = ["__version__", *sorted(_HOME)]
_RENAMED = {
    "exported": ("export", "problem format task"), "imported": ("read_drawing", "path"),
    "opened": ("open_pose", "problem task"),
}  # fmt: skip
"""Names of earlier versions, what they are called now, and the order of their arguments then."""


def __getattr__(name: str) -> Any:
    new, order = _RENAMED.get(name, (name, None))
    if new not in _HOME:
        raise AttributeError(f"module 'mechdae' has no attribute '{name}'")
    found = getattr(importlib.import_module(_HOME[new]), new)
    if name not in _RENAMED:
        return found
    return importlib.import_module("mechdae.records").renamed(found, name, order)


def _shown(how: str, result: object, columns: object = None, width: int = 0) -> str:
    """Return a result as "text" or "html": what rooms make of it that results do not know."""
    if how == "text":
        tables = importlib.import_module("mechdae.results.tables")
        text: str = tables.table(result, columns=columns, width=width)
        return text
    picture = importlib.import_module("mechdae.draw").data_url(result)
    html: str = importlib.import_module("mechdae.results.tables.notebook").html(result, picture)
    return html


def _finer(result: object, parts: int) -> Any:
    """Return the task of a result at more poses: what solves knows results, not the reverse."""
    return importlib.import_module("mechdae.tasks.dispatch.finer").finer(result, parts)


def _for_picture(*arguments: object) -> Any:
    """Return the result of a task as a picture needs it, for pictures of problems."""
    return importlib.import_module("mechdae.tasks.pictures").for_picture(*arguments)


def _with_sketch(problem: object) -> Any:
    """Return a problem without tasks with that of its sketch, for pictures."""
    return importlib.import_module("mechdae.tasks.pictures").with_sketch(problem)


def _sketched(subject: object) -> str:
    """Return the diagram of a sketch as an address for HTML, "" where it has none."""
    url: str = importlib.import_module("mechdae.draw").sketch_url(subject)
    return url


def __dir__() -> list[str]:
    return __all__
