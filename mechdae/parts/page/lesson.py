"""What a page teaches by: which length each number is, groups with their vector equations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import permutations
from typing import TYPE_CHECKING, Any, cast

import casadi as ca
import numpy as np

from mechdae.describe import GROUND, Mechanism
from mechdae.describe.coordinates import coordinate
from mechdae.describe.expression import names_in
from mechdae.draw.plans.rates import Rates
from mechdae.draw.plans.rates_in_space import RatesInSpace
from mechdae.draw.plans.relations import Relations, Spot, joints_of
from mechdae.draw.poses import seen
from mechdae.equations.parameters import parameters_of
from mechdae.motion.kinematics.prepared import Setting
from mechdae.motion.measures.transmission import dyads
from mechdae.results import Result, plain
from mechdae.types import Floats, Graph, Json

if TYPE_CHECKING:
    from mechdae.results import SweepResult

SAME = 1e-9
"""A number is a length where they differ by less than this share of it."""
LINES = 3
"""Most dimension lines of one number."""


def transmission(setting: Setting) -> tuple[list[str], Graph]:
    """Return joints that have a transmission angle, and (x, u, p) -> their lines (4 each)."""
    scene, p = setting.scene, setting.graphs.p
    found = dyads(scene) if scene.model.mechanism.dimension == 2 else []
    lines = [line for dyad in found for line in dyad.lines]
    column = scene.expression(ca.vertcat(ca.SX(0, 1), *lines))
    return [dyad.joint for dyad in found], ca.Function("transmit", [scene.x, scene.u, p], [column])


def dimensions_of(
    setting: Setting, sliders: Sequence[str], given: Sequence[float]
) -> tuple[list[Json], dict[str, list[int]]]:
    """Return where each slider is in the diagram, and the places of the sliders that move a point.

    ``lines`` of a slider are (kind, body or joint, from, to): "length" between two points of a
    body, "x", "y", "z" along an axis of it, "angle" of the way between them, "radius" and "axis"
    of a joint; ``parts`` are the bodies, joints and loads that it changes.
    """
    model = setting.scene.model
    mechanism, symbols = model.mechanism, ca.SX.sym("s", len(sliders))
    whole = parameters_of(model, sliders, symbols)
    places = [contact.point for contact in model.contacts.values()]
    column = ca.vertcat(ca.SX(0, 1), *model.numbers.values(), *places)
    rates = ca.jacobian(ca.substitute(column, model.p, whole), symbols)
    keys = [*model.numbers, *(f"{name}.{axis}" for name in model.contacts for axis in "xy")]
    moved: dict[int, list[str]] = {}
    for i, k in zip(*rates.sparsity().get_triplet(), strict=True):
        moved.setdefault(k, []).append(keys[i])
    count = len(model.numbers)
    known = ca.substitute(column[:count], model.p, whole), ca.densify(rates[:count, :])
    row, slopes = (np.array(part) for part in ca.Function("known", [symbols], [*known])(given))
    values, at = row.ravel(), {key: k for k, key in enumerate(model.numbers)}
    found, shape = [], dict[str, list[int]]()
    for k, name in enumerate(sliders):
        parts = dict.fromkeys(key.split(".")[0] for key in moved.get(k, ()))
        lines = []
        for key in moved.get(k, ()):
            part, _, word = key.partition(".")
            if word.count(".") == 1 and word[-1] in mechanism.axes:
                owners = shape.setdefault(key[:-2], [])
                owners += [] if k in owners else [k]
            joint = mechanism.joints.get(part)
            if joint is None or key not in at:
                continue
            if _same(abs(values[at[key]]), abs(given[k]), abs(slopes[at[key], k])):
                kind = "radius" if word.endswith("radius") else word
                ends = joint.second if kind == "length" else word
                if kind in ("radius", "axis", "length"):
                    lines.append([kind, part, joint.first, ends])
        for body in [part for part in parts if part == GROUND or part in mechanism.bodies]:
            names = [f"{body}.{point}" for point in mechanism.body(body).points]
            rows = np.array([[at[f"{point}.{axis}"] for axis in mechanism.axes] for point in names])
            possible = _lines(body, names, values[rows], slopes[rows, k], given[k], mechanism)
            lines += [line for line in [next(possible, None)] if line]
        parts |= dict.fromkeys(load for load in mechanism.loads if _names(mechanism, load, name))
        found.append({"lines": lines[:LINES], "parts": [part for part in parts if part != GROUND]})
    return found, shape


def _names(mechanism: Mechanism, load: str, name: str) -> bool:
    for value in vars(mechanism.loads[load]).values():
        for text in (
            (value,) if isinstance(value, str) else value if isinstance(value, tuple) else ()
        ):
            try:
                if isinstance(text, str) and name in names_in(text):
                    return True
            except Exception:  # a place, the name of a point: no expression
                continue
    return False


def _same(size: float, given: float, slope: float) -> bool:
    return abs(size - given) <= SAME * abs(given) and abs(slope - 1) <= SAME and given != 0


def _lines(
    body: str, names: Sequence[str], places: Floats, rates: Floats, given: float, space: Mechanism
) -> Iterator[list[str]]:
    """Yield the lines of a body that are a number, those between joints first."""
    used = {end for joint in space.joints.values() for end in (joint.first, joint.second)}
    pairs = sorted(
        permutations(range(len(names)), 2),
        key=lambda pair: (sum(names[k] not in used for k in pair), rates[pair[0]].any(), pair),
    )
    ways = [(names[i], names[j], places[j] - places[i], rates[j] - rates[i]) for i, j in pairs]
    size = abs(float(given))
    for one, two, way, rate in ways:
        length = float(np.linalg.norm(way))
        if length > 0 and _same(length, size, abs(float(way @ rate) / length)):
            yield ["length", body, one, two]
    for k, axis in enumerate(space.axes):
        for one, two, way, rate in ways:
            if _same(abs(way[k]), size, abs(rate[k])):
                yield [axis, body, one, two]
    for one, two, way, rate in ways if space.dimension == 2 else ():
        square, turn = float(way @ way), float(np.arctan2(way[1], way[0]))
        if square > 0 and _same(turn, given, float(way[0] * rate[1] - way[1] * rate[0]) / square):
            yield ["angle", body, one, two]


def groups_of(result: Result) -> Json:
    """Return groups with their vector equations, letters of points and numbers of links.

    An equation leads from one spot to another, on a link or past the slide of a ``joint``; a spot
    is a body, its point or the joint under whose second point it is, and a letter.
    """
    here, mechanism = seen(result), result.mechanism
    sweep, rates = cast("SweepResult", result), RatesInSpace if here.in_space else Rates
    relations = Relations(sweep, here.scene, here.pose, "velocity", rates)

    def listed(spot: Spot) -> list[str]:
        return [spot.body, spot.reference, spot.letter]

    groups = []
    for name, bodies in relations.groups:
        equations = [
            {
                "joint": "" if equation.body in bodies else equation.body,
                "start": listed(equation.start),
                "end": listed(equation.end),
            }
            for body in bodies
            for equation in relations.of(body, bodies)
        ]
        joints = joints_of(mechanism, relations.order, bodies)
        groups.append({"name": name, "bodies": list(bodies), "joints": joints, "all": equations})
    lead = coordinate(mechanism, next(iter(result.drivers))).part if result.drivers else ""
    return {
        "groups": groups,
        "spots": [listed(spot) for spot in relations.spots],
        "letters": relations.letters,
        "numbers": relations.numbers,
        "bars": bars_of(mechanism, lead),
    }


def bars_of(mechanism: Mechanism, lead: str) -> Json | None:
    """Return the bars of a four-bar or slider-crank with a crank on the ground, None of others.

    ``lead`` is the body or joint that is driven. ``bars``: name and two points of the driven link,
    of the coupler, of the last link and of the ground; a slider-crank has ``slide``, the guide of
    its last link, in place of the last two.
    """
    joints = mechanism.joints
    slides = [joint.name for joint in joints.values() if joint.guide]
    pins = [joint.name for joint in joints.values() if joint.hinge]
    if mechanism.dimension != 2 or not len(joints) == len(pins + slides) == 4 or len(slides) > 1:
        return None
    chain = [n for n in pins if GROUND in joints[n].bodies and lead in (n, *joints[n].bodies)][:1]
    around = [body for name in chain for body in joints[name].bodies if body != GROUND]
    while chain and len(around) < 4:  # over to the next link by another joint
        more = [name for name in joints if around[-1] in joints[name].bodies and name not in chain]
        if len(more) != 1:
            return None
        chain += more
        around += [body for body in joints[more[0]].bodies if body != around[-1]]
    if len(set(around)) != 4 or around[3] != GROUND:
        return None

    bars = [
        [body, *(joints[chain[i % 4]].ends_at(body)[0] for i in (k, k + 1))]
        for k, body in enumerate(around)
    ]
    if not slides:
        return {"bars": bars}
    return {"bars": bars[:2], "slide": slides[0]} if slides[0] == chain[3] else None


def series_of(result: Result, rows: Sequence[int]) -> Json:
    """Return curves of a recorded motion at poses, and its events.

    ``series``: kind, part, names of a quantity and its rates, unit, values of each of them.
    """
    found: list[list[object]] = []

    def put(kind: str, part: str, names: Sequence[str], unit: str, series: Any) -> None:
        values: list[Floats] = [np.asarray(series[name], dtype=float)[rows] for name in names]
        moving = values[0][np.isfinite(values[0])] if values else np.zeros(0)
        if moving.size and np.ptp(moving) > 0:
            found.append([kind, part, names, unit, plain(values)])

    for kind, words in (("bodies", ("angle", "angular_")), ("joints", ("slide", "slide_"))):
        for part, series in getattr(result, kind).items():
            names = [words[0], *(f"{words[1]}{rate}" for rate in ("velocity", "acceleration"))]
            names = [name for name in names if np.ndim(series.get(name, [[]])) == 1]
            if names[:1] == [words[0]]:
                put(kind, part, names, result.unit(kind, part, words[0]), series)
    scalars = getattr(result, "scalars", {})
    for part in ("energy", "kinetic", "potential"):
        put("scalars", part, [part] if part in scalars else [], "J", scalars)
    events = []
    for event in result.events:
        part = getattr(event, "joint", None) or getattr(event, "name", "")
        events += [] if event.at is None else [[float(np.ravel(event.at)[0]), event.kind, part]]
    return {"series": found, "events": events}
