"""Whether a task can be solved again in the browser, and the kernels and numbers for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe import GROUND, Sweep, Task
from mechdae.equations.model import Model
from mechdae.equations.parameters import parameters_of
from mechdae.errors import MechdaeError
from mechdae.kernels.bounds.walk import NoMajorant
from mechdae.kernels.graphs.steps import Graphs
from mechdae.motion.continuation.any_path import TURNING
from mechdae.motion.continuation.legs import Legs
from mechdae.motion.continuation.output_bounds import turned
from mechdae.motion.continuation.path import Path
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.motion.setup.outputs import RATES, Outputs
from mechdae.parts.page import page_drivers as ways
from mechdae.parts.page.programs.javascript import Operations, operations_of
from mechdae.types import Graph, Json

MOST_SLIDERS = 24
FAR = 2.5
"""A slider goes from a part to so many times the value in the file."""


MORE_TRIES = 4
"""Tries of steps that the page may make for each of Python's, which also has longer steps."""


def why_recorded(setting: Setting | None, run: Run | None, task: Task) -> str:
    """Return the key of the reason why a task cannot be live, "" where it can."""
    if not isinstance(task, Sweep) or task.kind != "sweep" or setting is None or run is None:
        return "open" if getattr(task, "kind", "") == "sweep" else "kind"
    graphs, path = setting.graphs, run.path
    if ways.cornered(setting):
        return "corners"
    if path.constants.measured or any(not c.closed or c.pieces for c in graphs.contacts):
        return "curves"
    if any(graph.redundant for graph in graphs.blocks):
        return "superfluous"
    if "limits" in graphs.scene.traits:
        return "limits"
    if path.zones or (isinstance(path, Path) and any(path.flips)):
        return "change points"
    if isinstance(path, Legs) and any(end.high and end.high.s <= 1 for end in path.reach.values()):
        return "begins"
    ends = [end.kind for reach in path.reach.values() for end in (reach.low, reach.high) if end]
    # at limit positions and poles the motion itself turns back
    return next((kind for kind in ends if kind not in TURNING), "")


def kernels(
    graphs: Graphs, model: Model, sliders: Sequence[str], more: Mapping[str, object]
) -> tuple[dict[str, Operations], Json]:
    """Return the functions that the page calls, with `more` by their names there.

    The second table is where each has its inputs and outputs.

    Raises
    ------
    NotPrintable
        An operation that cannot be printed.
    """
    names = ca.SX.sym("names", len(sliders))
    numbers = ca.Function("numbers", [names], [parameters_of(model, sliders, names)])
    rows, columns, slopes = slopes_of(graphs)
    scene, space = graphs.scene, model.mechanism
    fixed = [model.point(f"{GROUND}.{name}") for name in space.ground.points]
    ground = ca.Function("ground", [graphs.p], [ca.vertcat(ca.SX(0, 1), *fixed)])
    outputs = ca.Function("outputs", [scene.x, scene.u, graphs.p], [graphs.outputs])
    at, looks = looks_of(model)
    functions = {
        "numbers": numbers,
        "looks": looks,
        "ground": ground,
        "outputs": outputs,
        "constants": graphs.constants,
        "advance": graphs.advance,
        "pose": graphs.pose,
        "slopes": slopes,
    }
    if graphs.contacts:
        functions |= {"least": graphs.divisors[1], "curves": curves_of(graphs, model)}
    folds = {f"fold{b}": graphs.fold(b) for b in range(graphs.nb)}
    parts = {name: operations_of(f, name) for name, f in (functions | folds | dict(more)).items()}
    layout = {name: {"in": part.inputs, "out": part.outputs} for name, part in parts.items()}
    share = turned(graphs) if graphs.scene.model.mechanism.dimension == 3 else 0
    others = {"slopes_at": [rows, columns], "looks_at": at, "turned": share}
    return parts, layout | others


def looks_of(model: Model) -> tuple[list[list[str]], Graph]:
    """Return joints and keys of what symbols are drawn by, and these numbers over p."""
    keys = {"axis": "axis", "radius": "radius", "roller_radius": "roller"}
    space = model.mechanism
    found = [
        (name, key, model.numbers[f"{name}.{word}"])
        for name, joint in (space.joints.items() if space.dimension == 2 else ())
        for word, key in keys.items()
        if f"{name}.{word}" in model.numbers and not (key == "radius" and joint.wheels != 1)
    ]
    column = ca.vertcat(ca.SX(0, 1), *[number for _, _, number in found])
    return [[name, key] for name, key, _ in found], ca.Function("looks", [model.p], [column])


def curves_of(graphs: Graphs, model: Model) -> Any:
    """Return the function (share of the range, p) -> places on the curves of all joints."""
    share, places = ca.SX.sym("share"), []
    for contact in model.contacts.values():
        s = contact.start + share * (contact.end - contact.start)
        places.append(ca.substitute(contact.point, contact.s, s))
    return ca.Function("curves", [share, graphs.p], [ca.vertcat(*places)])


def entries_of(setting: Setting) -> list[Json]:
    """Return the reported quantities: kind, part, names with those of rates, columns, unit."""
    in_space = setting.scene.model.mechanism.dimension == 3

    def names(kind: str, name: str) -> list[str]:
        if in_space and kind == "joints":
            return [name, f"{name}_velocity", f"{name}_acceleration"]
        return list(RATES[name][:3])

    return [
        {
            "kind": entry.kind,
            "part": entry.part,
            "names": names(entry.kind, entry.name),
            "columns": list(entry.columns),
            "unit": "rad" if entry.is_orientation else entry.unit,
        }
        for entry in setting.outputs.entries
        if entry.kind != "hidden" and entry.name != "guide"
    ]


def bounded_of(outputs: Outputs) -> dict[str, list[int]]:
    """Return the columns that bounds of lengths and angles are told of, as in results."""
    known = outputs.bounded
    return {
        "lengths": known.get("length", []),
        "angles": known.get("angle", []),
        "matrices": list(outputs.matrices),
    }


def slopes_of(graphs: Graphs) -> tuple[list[int], list[int], Graph]:
    """Return bounds of the outputs' slopes with their places, and of their rounding."""
    function = graphs.output_bounds
    at = function.sx_in()
    slope, rounding = function(*at)
    entries = ca.vertcat(ca.SX(0, 1), *slope.nonzeros())
    rows, columns = slope.sparsity().get_triplet()
    made = ca.Function("slopes", at, [ca.densify(entries), ca.densify(rounding)])
    return list(rows), list(columns), made


def numbers_that_move(setting: Setting, forces: set[int]) -> list[str]:
    """Return the parameters of the file that may be changed: plain numbers that move something.

    Ratios of gears and numbers of teeth are not among them. Those at the places `forces` among
    the model's have a part in forces. Where the file has no parameters, the numbers of the model.
    """
    model = setting.scene.model
    mechanism = model.mechanism
    used = {*_used(setting), *(model.p_names[k] for k in forces)}
    plain = [name for name, number in mechanism.parameters.items() if not isinstance(number, str)]
    known = [name for name in plain if name in model.p_names]
    symbols = ca.SX.sym("s", len(known))
    whole = parameters_of(model, known, symbols)
    pattern = ca.jacobian(whole, symbols).sparsity() if known else ca.Sparsity(len(used), 0)
    # what gears turn by belongs to the structure: teeth are whole numbers
    wheels = [name for name, joint in mechanism.joints.items() if joint.wheels == 2]
    ratios = [model.numbers[f"{name}.ratio"] for name in wheels if f"{name}.ratio" in model.numbers]
    remaining = set(
        ca.jacobian(ca.vertcat(ca.SX(0, 1), *ratios), model.p).sparsity().get_triplet()[1]
    )
    moved, whole_numbers = set(), set()
    for i, j in zip(*pattern.get_triplet(), strict=True):
        if i in remaining:
            whole_numbers.add(known[j])
        if model.p_names[i] in used:
            moved.add(known[j])
    chosen = [name for name in known if name in moved - whole_numbers]
    if not mechanism.parameters:
        chosen = [n for k, n in enumerate(model.p_names) if n in used and k not in remaining]
    return chosen


def _used(setting: Setting) -> list[str]:
    """Return the numbers on which a pose depends."""
    graphs = setting.graphs
    rows = [setting.outputs.expression, *[graph.F for graph in graphs.blocks]]
    pattern = ca.jacobian(ca.vertcat(*rows), graphs.p).sparsity()
    columns = sorted(set(pattern.get_triplet()[1]))
    return [setting.scene.model.p_names[k] for k in columns]


def numbers_of(setting: Setting, run: Run) -> Json:
    """Return what the path begins with: pose, sizes, scale, weights, blocks."""
    graphs, path = setting.graphs, run.path
    constants = path.constants
    s, x = ways.start_of(path)
    groups = {group.index: group for group in setting.scene.groups}
    blocks = [
        {
            "own": list(graph.own),
            "chain": [i for k in graphs.ancestors(b) for i in graphs.blocks[k].own],
            "group": groups[graph.block.group].name,
            "joint": groups[graph.block.group].key_joint,
        }
        for b, graph in enumerate(graphs.blocks)
    ]
    columns, _ = graphs.units(constants.scale, constants.p)
    return {
        "x": x.tolist(),
        "s": float(s),
        "size_x": constants.size_x.tolist(),
        "size_u": constants.size_u.tolist(),
        "scale": float(constants.scale),
        "largest": float(path.largest),
        "tries": MORE_TRIES * (path.counts.steps + path.counts.rejected),
        "far": [None if np.isinf(far) else float(far) for far in path.far],
        "turns": bool(graphs.turns),
        "floors": len(constants.floors),
        "boxes": [part.T.tolist() for part in constants.boxes] if graphs.contacts else None,
        "weights": [weight for column in columns for weight in column.tolist()],
        "blocks": blocks,
        "nx": graphs.nx,
        "nb": graphs.nb,
        "nu": graphs.nu,
    }


def modes_of(setting: Setting, run: Run) -> list[Json]:
    """Return the assembly modes at the pose where the path begins."""
    s, x = ways.start_of(run.path)
    u = run.path.drivers(np.array([s]))[0]
    try:
        found = setting.assembler.modes(u)
    except (MechdaeError, NoMajorant):
        return []
    if found.count > 32:
        return []
    label = setting.assembler.labels.of_pose(x, u)
    return [{"label": m.label, "x": m.x.tolist(), "own": m.label == label} for m in found]
