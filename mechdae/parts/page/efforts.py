"""The balance of forces for the browser: its functions, and the numbers that they need."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import casadi as ca
import numpy as np

from mechdae.describe import Mechanism, coordinate
from mechdae.equations.reduction import Scene
from mechdae.forces.inverse_dynamics import InverseDynamics
from mechdae.forces.poses import LoadedRun, PoseForces, solved, unknown_columns
from mechdae.kernels.graphs.kinetostatics import SPEEDS
from mechdae.results import effort_unit
from mechdae.types import Graph, Json

PARAMETERS = 6
"""Place of the parameters among the inputs of the balance."""


def why_without(statics: InverseDynamics) -> str:
    """Return the key of the reason why forces cannot be live, "" where they can."""
    if statics.scene.model.space.behind:
        return "space"
    if statics.scene.redundant:
        return "reactions"
    if statics.loads.timed:
        return "timed"
    return ""


def functions(statics: InverseDynamics) -> Mapping[str, object]:
    """Return the functions that the page calls, by the names that they have there."""
    balance = statics.balance
    found = {"report": balance.report(statics.coupled), "slipping": balance.slipping}
    model, bodies = balance.model, balance.bodies
    places = [place(body) for body in bodies for place in (model.origin, model.mass_center)]
    rows = [row for *_, row in acting(statics)]
    found["acting"] = balance.function(
        "acting", [ca.vertcat(ca.SX(0, 1), *rows), ca.vertcat(*places)]
    )
    if balance.slips:
        found["coming"] = balance.coming
    if balance.feedbacks:
        found["sizes"] = balance.solve
    if statics.coupled:
        found["stages"] = balance.stages
    if statics.tables:
        at = ca.vertcat(*[signal.at for signal in statics.loads.signals])
        found["abscissae"] = balance.function("at", [at], SPEEDS)
    return found


def acting(statics: InverseDynamics) -> Iterator[tuple[str, str, str, Graph]]:
    """Yield what acts on bodies beside reactions: kind, name, body, force and moment at its origin.

    Kinds are "weight", "load", "inertia" and "drive", which is told for a unit of its effort.
    """
    balance, model = statics.balance, statics.balance.model
    drivers = {name: coordinate(model.mechanism, name) for name in _drivers(balance.scene)}
    every = [
        ("weight" if n == "gravity" else "load", n, w) for n, w in balance.loads.wrenches.items()
    ]
    every.append(("inertia", "", {k: -row for k, row in balance.inertia.items()}))
    every += [("drive", name, model.gradient(driver)) for name, driver in drivers.items()]
    for kind, name, wrench in every:
        for body in balance.bodies:
            row = model.space.at_origin(model, wrench, body)
            if row is not None and row.nnz():
                yield kind, name, body, ca.densify(row)


def _drivers(scene: Scene) -> list[str]:
    return [row.owner for row in scene.rows if row.driver]


def _place(mechanism: Mechanism, kind: str, name: str, body: str) -> str:
    """Return the point of a body at which something acts, "" where no point is named."""
    load = mechanism.loads.get(name) if kind == "load" else None
    ends = (getattr(load, "point", None), *(getattr(load, "between", None) or ()))
    named = [str(end) for end in ends if end and end.split(".")[0] == body]
    text = getattr(load, "along", None) or getattr(load, "coordinate", None)
    if named or (load is not None and text is None) or kind not in ("load", "drive"):
        return named[0] if named else ""
    at = coordinate(mechanism, str(text or name))
    joint = mechanism.joints.get(at.part)
    return joint.second if joint else f"{body}.{at.point}" if at.point else ""


def used(statics: InverseDynamics) -> set[int]:
    """Return the places of the parameters on which forces depend."""
    report = statics.balance.report(statics.coupled)
    found: set[int] = set()
    for k in range(report.n_out()):
        found |= set(report.jac_sparsity(k, PARAMETERS).get_triplet()[1])
    if statics.balance.feedbacks:
        sizes = statics.balance.solve
        for k in range(2):
            found |= set(sizes.jac_sparsity(k, PARAMETERS).get_triplet()[1])
    return found


def numbers(loaded: LoadedRun, rows: list[int]) -> Json:
    """Return what the page needs beside the functions, and the forces at some of the poses."""
    statics, setting = loaded.statics, loaded.setting
    balance = statics.balance
    groups = [
        {"places": places, "forms": [[form.start, form.stop] for form in forms], "laws": laws}
        for places, forms, laws in statics.branches.groups
    ]
    tables = [
        {"rows": table.tolist(), "periodic": bool(signal.load.periodic)}
        for table, signal in zip(statics.tables, statics.loads.signals, strict=True)
    ]
    model, drivers = setting.scene.model, _drivers(setting.scene)
    way = 1 if balance.loads.turned else -1
    second = {name: joint.second for name, joint in model.mechanism.joints.items()}
    return {
        "columns": unknown_columns(setting),
        "joints": [{"name": name, "at": second[name]} for name in balance.joints],
        "efforts": drivers,
        "bodies": list(balance.bodies),
        "acting": [
            [kind, name, body, _place(model.mechanism, kind, name, body)]
            for kind, name, body, _ in acting(statics)
        ],
        "units": {name: effort_unit(model.mechanism, name) for name in drivers},
        "lossy": list(balance.lossy),
        "slips": [slip.unit for slip in balance.slips],
        "resistances": [
            [slip.owner, way, k] for k, slip in enumerate(balance.slips) if slip.falls is not None
        ],
        "feedbacks": [feedback.joint for feedback in balance.feedbacks],
        "groups": groups,
        "tables": tables,
        "coupled": statics.coupled,
        "length": float(statics.length),
        "zero": float(loaded.run.values[0, setting.plan.lead]),
        "checks": _checks(loaded, rows),
    }


def _checks(loaded: LoadedRun, rows: list[int]) -> list[Json]:
    """Return reactions and efforts of some of the poses, those that have one solution."""
    motion, statics = loaded.motion.rows(rows), loaded.statics
    answer: PoseForces = solved(statics, motion, motion.there, critical=False)
    found = []
    for k, row in enumerate(rows):
        if answer.counts[k] != 1 or not answer.there[k]:
            continue
        whole = answer.whole
        forces = [whole.reactions[k].ravel(), whole.efforts[k], whole.losses[k]]
        if all(np.isfinite(values).all() for values in forces):
            values = loaded.run.poses.s
            found.append({"s": float(values[row]), "f": [values.tolist() for values in forces]})
    return found
