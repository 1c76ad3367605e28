"""Written by ``python -m tests.scripts.stub``: names, and what tasks give."""

from collections.abc import Callable, Mapping
from typing import overload

from mechdae.describe.file.library import new as new
from mechdae.describe.file.load import Source
from mechdae.describe.file.load import load as load
from mechdae.describe.file.problem import Expected as Expected
from mechdae.describe.file.problem import Problem as Problem
from mechdae.describe.file.writing import dump as dump
from mechdae.describe.file.writing import dumps as dumps
from mechdae.describe.joints.curve import Curve as Curve
from mechdae.describe.joints.pairs import Distance as Distance
from mechdae.describe.joints.pairs import PinInSlot as PinInSlot
from mechdae.describe.joints.pairs import Prismatic as Prismatic
from mechdae.describe.joints.pairs import Revolute as Revolute
from mechdae.describe.joints.pairs import Weld as Weld
from mechdae.describe.joints.spatial import Cylindrical as Cylindrical
from mechdae.describe.joints.spatial import PlanarPair as PlanarPair
from mechdae.describe.joints.spatial import Screw as Screw
from mechdae.describe.joints.spatial import SpatialGear as SpatialGear
from mechdae.describe.joints.spatial import SpatialPrismatic as SpatialPrismatic
from mechdae.describe.joints.spatial import SpatialRack as SpatialRack
from mechdae.describe.joints.spatial import SpatialRevolute as SpatialRevolute
from mechdae.describe.joints.spatial import SpatialWeld as SpatialWeld
from mechdae.describe.joints.spatial import Spherical as Spherical
from mechdae.describe.joints.spatial import Universal as Universal
from mechdae.describe.joints.wheels import Belt as Belt
from mechdae.describe.joints.wheels import FrictionWheel as FrictionWheel
from mechdae.describe.joints.wheels import Gear as Gear
from mechdae.describe.joints.wheels import Rack as Rack
from mechdae.describe.loads import Force as Force
from mechdae.describe.loads import Resistance as Resistance
from mechdae.describe.loads import Spring as Spring
from mechdae.describe.loads import TableLoad as TableLoad
from mechdae.describe.loads import TimeTable as TimeTable
from mechdae.describe.loads import Torque as Torque
from mechdae.describe.mechanism import Body as Body
from mechdae.describe.mechanism import Ground as Ground
from mechdae.describe.mechanism import Mechanism as Mechanism
from mechdae.describe.tasks.kinds import Driver as Driver
from mechdae.describe.tasks.kinds import Modes as Modes
from mechdae.describe.tasks.kinds import Sweep as Sweep
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.tasks.motion import Equilibrium as Equilibrium
from mechdae.describe.tasks.motion import Motion as Motion
from mechdae.describe.tasks.motion import Reactions as Reactions
from mechdae.describe.tasks.studies import Sensitivity as Sensitivity
from mechdae.describe.tasks.studies import Study as Study
from mechdae.describe.tasks.synthesis import Synthesis as Synthesis
from mechdae.describe.units import SI, Units
from mechdae.describe.values import Number
from mechdae.describe.vectors.expand import from_loops as from_loops
from mechdae.describe.vectors.loops_of import loops_of as loops_of
from mechdae.describe.vectors.values import Node as Node
from mechdae.describe.vectors.values import Vector as Vector
from mechdae.design.derivatives.function import function as function
from mechdae.draw import plot as plot
from mechdae.errors import AssemblyError as AssemblyError
from mechdae.errors import InconsistentStartError as InconsistentStartError
from mechdae.errors import IndeterminateFrictionError as IndeterminateFrictionError
from mechdae.errors import InfeasibleMotionError as InfeasibleMotionError
from mechdae.errors import InputError as InputError
from mechdae.errors import MechanismError as MechanismError
from mechdae.errors import MechdaeError as MechdaeError
from mechdae.errors import ProblemFileError as ProblemFileError
from mechdae.errors import SingularMassError as SingularMassError
from mechdae.errors import SolveError as SolveError
from mechdae.errors import UnavailableError as UnavailableError
from mechdae.errors import UnknownName as UnknownName
from mechdae.motion.cases.open.open_mechanism import open_pose as open_pose
from mechdae.numerics.arms.chain import Arm as Arm
from mechdae.numerics.arms.poses import arm_poses as arm_poses
from mechdae.numerics.homotopy.platforms import platform_poses as platform_poses
from mechdae.parts.exchange import Exported as Exported
from mechdae.parts.exchange import export as export
from mechdae.parts.exchange import read_drawing as read_drawing
from mechdae.parts.exchange.robots.arm_of_urdf import arm_from_urdf as arm_from_urdf
from mechdae.parts.models.builder import DrawnMechanism as DrawnMechanism
from mechdae.parts.models.builder import build as build
from mechdae.parts.models.factories import cylinder as cylinder
from mechdae.parts.models.factories import five_bar as five_bar
from mechdae.parts.models.factories import four_bar as four_bar
from mechdae.parts.models.factories import inverted_slider_crank as inverted_slider_crank
from mechdae.parts.models.factories import rssr as rssr
from mechdae.parts.models.factories import slider_crank as slider_crank
from mechdae.parts.models.factories import stephenson as stephenson
from mechdae.parts.models.factories import watt as watt
from mechdae.parts.page import Page as Page
from mechdae.parts.page import page as page
from mechdae.parts.paper.assignments import Assignment as Assignment
from mechdae.parts.paper.assignments import Assignments as Assignments
from mechdae.parts.paper.assignments import assign as assign
from mechdae.parts.paper.explanations import Explanation as Explanation
from mechdae.parts.paper.explanations import explain as explain
from mechdae.parts.paper.reports import Report as Report
from mechdae.parts.paper.reports import report as report
from mechdae.parts.play.task import Play as Play
from mechdae.parts.proof import certify as certify
from mechdae.parts.proof import check_certificate as check_certificate
from mechdae.parts.types.chains.chains import KinematicChain as KinematicChain
from mechdae.parts.types.chains.chains import assur_groups as assur_groups
from mechdae.parts.types.chains.chains import chains as chains
from mechdae.parts.types.chains.chains import count_chains as count_chains
from mechdae.parts.types.chains.mechanisms import mechanism_of as mechanism_of
from mechdae.parts.types.chains.mechanisms import problem_of as problem_of
from mechdae.parts.types.chains.variants.scheme import Variant as Variant
from mechdae.parts.types.described.task import Composition as Composition
from mechdae.parts.types.described.task import CurveGoal as CurveGoal
from mechdae.parts.types.ranking.judges import Judgment as Judgment
from mechdae.parts.types.ranking.judges import judged as judged
from mechdae.parts.types.ranking.rank import Ranking as Ranking
from mechdae.parts.types.ranking.rank import rank as rank
from mechdae.parts.types.ranking.variants import count_variants as count_variants
from mechdae.parts.types.ranking.variants import variants as variants
from mechdae.results import EquilibriumResult as EquilibriumResult
from mechdae.results import ModesResult as ModesResult
from mechdae.results import MotionResult as MotionResult
from mechdae.results import ReactionsResult as ReactionsResult
from mechdae.results import Result as Result
from mechdae.results import SensitivityResult as SensitivityResult
from mechdae.results import Status as Status
from mechdae.results import StudyResult as StudyResult
from mechdae.results import SweepResult as SweepResult
from mechdae.results import SynthesisResult as SynthesisResult
from mechdae.tasks.designing import synthesize as synthesize
from mechdae.tasks.export.folder import StoredResults as StoredResults
from mechdae.tasks.export.folder import read as read
from mechdae.tasks.export.folder import save as save
from mechdae.tasks.parameter_studies import screen as screen
from mechdae.tasks.parameter_studies import study as study
from mechdae.tasks.solver import Solver as Solver

__version__: str
PARTS: tuple[str, ...]
CASES: dict[str, str]
__all__ = [
    "Arm",
    "AssemblyError",
    "Assignment",
    "Assignments",
    "Belt",
    "Body",
    "Composition",
    "Curve",
    "CurveGoal",
    "Cylindrical",
    "Distance",
    "DrawnMechanism",
    "Driver",
    "Equilibrium",
    "EquilibriumResult",
    "Expected",
    "Explanation",
    "Exported",
    "Force",
    "FrictionWheel",
    "Gear",
    "Ground",
    "InconsistentStartError",
    "IndeterminateFrictionError",
    "InfeasibleMotionError",
    "InputError",
    "Judgment",
    "KinematicChain",
    "Mechanism",
    "MechanismError",
    "MechdaeError",
    "Modes",
    "ModesResult",
    "Motion",
    "MotionResult",
    "Node",
    "Page",
    "PinInSlot",
    "PlanarPair",
    "Play",
    "Prismatic",
    "Problem",
    "ProblemFileError",
    "Rack",
    "Ranking",
    "Reactions",
    "ReactionsResult",
    "Report",
    "Resistance",
    "Result",
    "Revolute",
    "Screw",
    "Sensitivity",
    "SensitivityResult",
    "SingularMassError",
    "SolveError",
    "Solver",
    "SpatialGear",
    "SpatialPrismatic",
    "SpatialRack",
    "SpatialRevolute",
    "SpatialWeld",
    "Spherical",
    "Spring",
    "Status",
    "StoredResults",
    "Study",
    "StudyResult",
    "Sweep",
    "SweepResult",
    "Synthesis",
    "SynthesisResult",
    "TableLoad",
    "TimeTable",
    "Torque",
    "UnavailableError",
    "Universal",
    "UnknownName",
    "Variant",
    "Vector",
    "Weld",
    "__version__",
    "arm_from_urdf",
    "arm_poses",
    "assign",
    "assur_groups",
    "build",
    "certify",
    "chains",
    "check_certificate",
    "count_chains",
    "count_variants",
    "cylinder",
    "dump",
    "dumps",
    "explain",
    "export",
    "five_bar",
    "four_bar",
    "from_loops",
    "function",
    "inverted_slider_crank",
    "judged",
    "load",
    "loops_of",
    "mechanism_of",
    "new",
    "open_pose",
    "page",
    "platform_poses",
    "plot",
    "problem_of",
    "rank",
    "read",
    "read_drawing",
    "report",
    "rssr",
    "save",
    "screen",
    "slider_crank",
    "solve",
    "stephenson",
    "study",
    "synthesize",
    "variants",
    "watt",
]

@overload
def solve(
    problem: Source,
    task: Play,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    units: str | Units = SI,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> SweepResult: ...
@overload
def solve(
    problem: Source,
    task: Reactions,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    units: str | Units = SI,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> ReactionsResult: ...
@overload
def solve(
    problem: Source,
    task: Modes,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    units: str | Units = SI,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> ModesResult: ...
@overload
def solve(
    problem: Source,
    task: Sweep,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    units: str | Units = SI,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> SweepResult: ...
@overload
def solve(
    problem: Source,
    task: Composition,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    units: str | Units = SI,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> SynthesisResult: ...
@overload
def solve(
    problem: Source,
    task: Equilibrium,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    units: str | Units = SI,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> EquilibriumResult: ...
@overload
def solve(
    problem: Source,
    task: Motion,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    units: str | Units = SI,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> MotionResult: ...
@overload
def solve(
    problem: Source,
    task: Sensitivity,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    units: str | Units = SI,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> SensitivityResult: ...
@overload
def solve(
    problem: Source,
    task: Study,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    units: str | Units = SI,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> StudyResult: ...
@overload
def solve(
    problem: Source,
    task: Synthesis,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    units: str | Units = SI,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> SynthesisResult: ...
@overload
def solve(
    problem: Source,
    task: Task | str | None = None,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    units: str | Units = SI,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Result: ...
