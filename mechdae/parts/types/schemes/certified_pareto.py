"""The front of a search: its designs in the place of the wanted curve, each certified."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechdae.describe import Problem
from mechdae.numerics.dominance import best_of, hypervolume, undominated
from mechdae.parts.types.described.composition import OBJECTIVES, CompositionDemand
from mechdae.parts.types.schemes.aims import ANGLE, CURVE, PATH, Aim
from mechdae.parts.types.schemes.closure import turned
from mechdae.parts.types.schemes.designs import (
    at_targets,
    certified,
    crank_angle,
    dimensions,
    loss_of,
    output,
    point_names,
    problem_of_scheme,
    text_of_design,
    tracer,
)
from mechdae.parts.types.schemes.losses import rubbing_of
from mechdae.parts.types.schemes.placed_design import PlacedDesign, placed_design, ways_of
from mechdae.parts.types.schemes.scheme import Scheme
from mechdae.parts.types.schemes.shape import Wanted, distances
from mechdae.parts.types.schemes.targets.visits import errors_of
from mechdae.parts.types.schemes.verified import verified
from mechdae.parts.types.schemes.work_items import ROUNDED, Archive, SizedScheme
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Matrix

ANGLES = 360
"""Crank angles by which ends of guides are found."""
TURN = 2 * np.pi
MOST = 120
"""Points of a front out of which those are chosen that are certified."""
DRAWN, FINELY = 5, 2
"""Of the poses of a certificate every so many are kept of the path, to be drawn; with targets."""
SAME = 1e-6
"""Share of an objective's range below which two designs are one."""


@dataclass
class SchemeFront:
    """Certified designs that no other one dominates, and what was thrown away.

    ``dominated``: number of certified designs that another one dominates. ``nearest``: of what is
    outside the limits: the values that came nearest, by objective.
    """

    designs: list[dict[str, Any]]
    rejected: list[dict[str, Any]]
    dominated: int
    nearest: dict[str, float]
    summary: dict[str, Any]


def front_of(
    demand: CompositionDemand, archive: Archive, aim: Aim, name: str, title: str
) -> SchemeFront:
    """Return the front of what was found."""
    signs = np.array([OBJECTIVES[objective][1] for objective in demand.objectives], float)
    every = archive.every
    entries = [entry for entry in every if _within(demand, entry, aim)]
    values = np.array(
        [[e.value(objective, aim) for objective in demand.objectives] for e in entries]
    ).reshape(len(entries), len(signs)) * signs  # fmt: skip
    left = np.ones(len(entries), bool)
    judged: dict[int, dict[str, Any]] = {}
    rejected: list[dict[str, object]] = []
    reference = _reference(demand, values, signs)
    while True:
        chosen = _chosen(values, left, reference, demand.keep)
        missing = [k for k in chosen if k not in judged]
        if not missing:
            break
        for k in missing:
            design = judged[k] = design_of(entries[k], aim, name, title, demand)
            if design.get("reasons"):
                left[k] = False
                error = entries[k].error * aim.unit
                rejected.append({"objective": error, "reasons": design["reasons"]})
    designs = [judged[k] for k in chosen]
    front = best_of(designs, signs, SAME)
    nearest = {}
    for measure in demand.within:
        sign = OBJECTIVES[measure][1]
        nearest[measure] = min((e.value(measure, aim) * sign for e in every), default=np.nan) * sign
    summary = _described(demand, front, signs) if front else {}
    return SchemeFront(front, rejected, len(designs) - len(front), nearest, summary)


def _within(demand: CompositionDemand, entry: SizedScheme, aim: Aim) -> bool:
    """Return whether an entry keeps the limits."""
    for name, limit in demand.within.items():
        sign = OBJECTIVES[name][1]
        if sign * entry.value(name, aim) > sign * limit:
            return False
    return True


def _reference(demand: CompositionDemand, values: Matrix, signs: Floats) -> Any:
    if demand.reference is not None:
        return np.array(demand.reference, float) * signs
    front = values[undominated(values)] if len(values) else np.ones((1, len(signs)))
    return front.max(axis=0) + 1e-9 * np.abs(front).max(axis=0) + 1e-12


def _chosen(values: Matrix, left: Booleans, reference: Floats, keep: int) -> list[int]:
    """Return the places of points of a front, at most `keep`, that dominate most together."""
    at = np.flatnonzero(left)
    if not len(at):
        return []
    at = at[undominated(values[at])]
    inside = at[(values[at] <= reference).all(axis=1)]
    at = inside if len(inside) else at
    at = at[np.lexsort(values[at].T[::-1])]
    _, first = np.unique(values[at], axis=0, return_index=True)
    at = at[np.sort(first)]
    if len(at) > MOST:
        at = at[np.unique(np.linspace(0, len(at) - 1, MOST).astype(int))]
    if len(at) <= keep:
        return [int(k) for k in at]
    # ends first: they have the least of each objective
    chosen = list(dict.fromkeys(int(at[values[at, m].argmin()]) for m in range(values.shape[1])))
    far = reference + 0.05 * (reference - values[at].min(axis=0)) + 1e-12
    while len(chosen) < keep:
        gains = [-1.0 if k in chosen else hypervolume(values[[*chosen, int(k)]], far) for k in at]
        chosen.append(int(at[int(np.argmax(gains))]))
    return sorted(chosen, key=lambda k: tuple(values[k]))


def design_of(
    entry: SizedScheme, aim: Aim, name: str, title: str, demand: CompositionDemand
) -> dict[str, object]:
    """Return a certified design as it is reported, or why it is none."""
    scheme, names = entry.scheme, point_names(entry.scheme)
    place = placed_design(entry, aim, demand)
    spots = place.places
    words = f"{title or name}: {len(scheme.links)} links, {scheme.joints} joints"
    rubbing = rubbing_of(demand)
    problem = problem_of_scheme(scheme, place, name, words, rubbing, aim)
    point = tracer(scheme)
    found = certified(problem, point)
    if found.reasons:
        return {"reasons": found.reasons}
    error, values_at = _error(problem, scheme, place, aim, found.curve)
    if error is None:
        return {"reasons": ["a target is not on the path that is certified"]}
    loss = None if rubbing is None else loss_of(problem)
    if rubbing is not None and loss is None:
        return {"reasons": ["with friction the crank does not turn it through"]}
    measured = {
        "loss": loss or 0.0, "error": error, "material": entry.material * aim.radius,
        "joints": scheme.joints, "points": scheme.size,
        "transmission_angle": found.transmission,
    }  # fmt: skip
    for measure, limit in demand.within.items():
        sign = OBJECTIVES[measure][1]
        if sign * measured[measure] > sign * limit * (1 + 1e-9 * sign):
            return {"reasons": [f"{measure} is {measured[measure]:.6g} over the whole turn"]}
    text = text_of_design(problem)
    start = crank_angle(scheme, place)
    at = np.array([start]) if place.at is None else start + place.at
    coordinate = values_at.get("output", point)
    wrong = verified(text, demand, error, coordinate, at, aim.unit)
    if wrong:
        return {"reasons": wrong}
    compared = measured | {"error": max(error, ROUNDED * aim.unit)}
    values = [float(compared[objective]) for objective in demand.objectives]
    drawn = DRAWN if aim.what == CURVE else FINELY
    return {
        "objective": values[0], "objectives": values, "error": error,
        "material": measured["material"], "joints": scheme.joints, "points": scheme.size,
        "links": len(scheme.links), "class": f"{len(scheme.links)} links",
        "scheme": scheme.text, "traced": point,
        "transmission_angle_min": found.transmission,
        "places": {n: [float(z.real), float(z.imag)] for n, z in zip(names, spots, strict=True)},
        "link_points": [[names[k] for k in link] for link in scheme.links],
        "path": [[float(z.real), float(z.imag)] for z in found.curve[::drawn]],
        **({} if loss is None else {"loss": loss}), **values_at, **_guides(scheme, place),
        "parameters": dict(dimensions(problem.mechanism)), "problem": text,
    }  # fmt: skip


def _error(
    problem: Problem, scheme: Scheme, place: PlacedDesign, aim: Aim, curve: Complexes
) -> tuple[float | None, dict[str, Any]]:
    """Return the error of a certified design, and its values at targets; None: one is missed."""
    if aim.what == CURVE:
        wanted = Wanted(np.array(aim.corners))
        return float(distances(curve[None] / wanted.radius, wanted)[0]), {}
    coordinate = tracer(scheme) if aim.what == PATH else output(scheme, aim)
    found = at_targets(problem, coordinate)
    if found is None:
        return None, {}
    gaps = found - place.wanted
    if aim.what == PATH:
        gaps = gaps[:, 0] + 1j * gaps[:, 1]
    elif aim.what == ANGLE:
        gaps = gaps - TURN * np.round(gaps / TURN)
    start = crank_angle(scheme, place)
    at_places = {"input": (start + place.at).tolist(), "values": np.asarray(found).tolist()}
    return float(errors_of(gaps[None], aim)[0]), at_places | {"output": coordinate}


def _guides(scheme: Scheme, place: PlacedDesign) -> dict[str, object]:
    """Return where the ends of guides are, and which link each is on."""
    if not scheme.slides:
        return {}
    low, high = place.span
    angles = np.append(0.0, np.linspace(low, high, ANGLES))
    x = turned(scheme, np.asarray(place.places)[None], angles).x[:, 0]
    return {
        "guides": [
            {"link": link, "block": block, "ends": [[z.real, z.imag] for z in ends]}
            for (_, link, block), ends in zip(scheme.slides, ways_of(scheme, x), strict=True)
        ]
    }


def _described(
    demand: CompositionDemand, kept: Sequence[Mapping[str, object]], signs: Floats
) -> dict[str, object]:
    """Return the front as it is reported: points, reference, hypervolume."""
    values = np.array([design["objectives"] for design in kept])
    worst = (values * signs).max(axis=0) * signs
    reference = np.array(demand.reference if demand.reference is not None else worst, float)
    varied = np.flatnonzero((np.ptp(values, axis=0) > 0) | (demand.reference is not None))
    room = 0.0  # an objective that all have alike bounds nothing
    if len(varied) > 1:
        room = hypervolume((values * signs)[:, varied], (reference * signs)[varied])
    return {
        "objectives": [
            {"name": objective.replace("_", " "), "unit": demand.unit(objective),
             "sense": "least" if OBJECTIVES[objective][1] > 0 else "largest"}
            for objective in demand.objectives
        ],
        "points": values.tolist(),
        "reference": reference.tolist(),
        "hypervolume": room,
    }  # fmt: skip
