"""Assembly modes by trying all branch signs and all roots of each group."""

from __future__ import annotations

import itertools

import numpy as np

import mechdae as md

from .elements import DRIVERS
from .labels import label_faults
from .unclosed import SYSTEMS

UNSURE = 1e-10


def countable(case):
    """Return whether modes differ by signs and roots alone.

    A gear on a body of an earlier group tells whole turns of that body apart: then it is not
    the signs that count the modes.
    """
    plain = {"ground"}
    for element in case.elements:
        data = element.data
        if element.kind == "geared":
            return False
        if element.kind == "gear" and not {data["carrier"], data["other"]} <= plain:
            return False
        if element.kind == "rack" and data["wheel"][0] not in plain:
            return False
        if element.kind in (*DRIVERS[:2], "gear"):
            plain |= set(element.bodies)
    return True


@np.errstate(all="ignore")
def count_modes(case):
    """Return the number of assembly modes at the sketch, None where that is not sure."""
    found = [[]]
    for k, element in enumerate(case.elements):
        ahead = []
        for signs in found:
            if element.kind in SYSTEMS:
                world = case.close([case.s0], signs=signs or None, upto=k)
                roots = SYSTEMS[element.kind](world, element).all_roots()
                if roots is None:
                    return None
                ahead += [[*signs, root] for root in roots]
                continue
            if not element.sign:
                ahead.append([*signs, 0])
                continue
            world = case.close([case.s0], signs=[*signs, 1], upto=k + 1)
            disc = float(world.discs[k].c[0][0].real)
            if not abs(disc) > UNSURE:
                return None
            if disc > 0:
                ahead += [[*signs, sign] for sign in (1, -1)]
        found = ahead
    return len(found)


def mode_faults(case, most=4):
    """Compare the count of modes with all signs tried, and each label with its own sweep."""
    at = {"at": [case.s0]}
    mechanism = case.mechanism()
    result = md.solve(mechanism, md.Modes(md.Driver(case.coordinate, **at)))
    labels = [",".join(row) for row in result.labels]
    count = count_modes(case) if countable(case) else None
    wrong = []
    proven = result.summary["proven"]
    if count is not None and (count < len(labels) or (proven and count != len(labels))):
        wrong.append(f"{len(labels)} modes, {count} by trying all signs")
    if count is not None and not proven and all(e.kind not in SYSTEMS for e in case.elements):
        wrong.append("the count of modes is not proven")
    if len(set(labels)) != len(labels):
        wrong.append(f"two modes have one label: {labels}")
    if countable(case):
        wrong += label_faults(case, mechanism, result)
    for row, label in itertools.islice(enumerate(labels), most):
        task = md.Sweep(md.Driver(case.coordinate, **at), mode=label)
        sweep = md.solve(case.mechanism(), task)
        if sweep.summary["mode"].replace(" ", "") != label:
            wrong.append(f"asked for {label}, got {sweep.summary['mode']}")
        for name, series in sweep.points.items():
            gap = np.abs(series.position[0] - result.points[name].position[row]).max()
            if not gap < 1e-9 * case.size:
                wrong.append(f"mode {label}: {name} {gap:.2g} from the pose of the sweep")
                break
    return wrong
