"""What of a mechanism can take each other's places: of its structure, of its dimensions too."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from math import isclose

from mechdae.describe import GROUND, Mechanism
from mechdae.errors import InputError
from mechdae.parts.types.chains.labelling import automorphisms

MOST = 40
"""Links of a mechanism whose symmetries are looked for."""
NEAR = 1e-9
"""Share of a length by which equal ones may differ."""


def of_structure(mechanism: Mechanism, kinds: bool) -> list[tuple[dict[str, str], dict[str, str]]]:
    """Return where links and joints go under each symmetry of both that keeps the frame."""
    found = []
    for links in _moves(mechanism, fixed=True, kinds=kinds):
        joints = _joints(mechanism, links)
        if joints is not None:
            found.append((links, joints))
    return found


def of_dimensions(mechanism: Mechanism) -> list[dict[str, str]]:
    """Return where links go under each symmetry that keeps kinds, lengths, masses and friction."""
    found = []
    shapes = _shapes(mechanism)
    for links in _moves(mechanism, fixed=False, kinds=True):
        joints = _joints(mechanism, links)
        if joints is not None and any(
            all(
                _alike(shapes[link], shapes[to], joints, mirrored)
                for link, to in links.items()
            )
            for mirrored in (False, True)
        ) and _same_joints(mechanism, joints):  # fmt: skip
            found.append(links)
    return found


def _moves(mechanism: Mechanism, fixed: bool, kinds: bool) -> list[dict[str, str]]:
    names = [GROUND, *mechanism.bodies]
    if len(names) > MOST:
        raise InputError(
            f"{len(names)} links: variants are counted of {MOST} at most", where="bodies"
        )
    place = {name: k for k, name in enumerate(names)}
    between: dict[tuple[int, int], list[str]] = {}
    for joint in mechanism.joints.values():
        pair = sorted((place[joint.first_body], place[joint.second_body]))
        between.setdefault((pair[0], pair[1]), []).append(joint.kind if kinds else "")
    labels: dict[Hashable, int] = {}
    matrix = [[0] * len(names) for _ in names]
    for (u, v), joints_between in between.items():
        label = labels.setdefault(tuple(sorted(joints_between)), len(labels) + 1)
        matrix[u][v] = matrix[v][u] = label
    colours = [int(fixed and name == GROUND) for name in names]
    found = automorphisms(colours, tuple(map(tuple, matrix)))
    return [{names[k]: names[to] for k, to in enumerate(move)} for move in found]


def _joints(mechanism: Mechanism, links: Mapping[str, str]) -> dict[str, str] | None:
    """Return where joints go when links do: those between two links in their order."""
    where: dict[frozenset[str], list[str]] = {}
    for name, joint in mechanism.joints.items():
        where.setdefault(frozenset((joint.first_body, joint.second_body)), []).append(name)
    moved: dict[str, str] = {}
    for pair, names in where.items():
        other = where.get(frozenset(links[link] for link in pair), [])
        if len(other) != len(names):
            return None
        moved |= dict(zip(names, other, strict=True))
    return moved


def _shapes(mechanism: Mechanism) -> dict[str, tuple[dict[str, complex], tuple[float, ...]]]:
    """Return for each link the places of its joints in it, with those of other points, and mass."""
    values = mechanism.values()
    shapes: dict[str, tuple[dict[str, complex], tuple[float, ...]]] = {}
    for name in (GROUND, *mechanism.bodies):
        places: dict[str, complex] = {}
        used = set()
        for joint_name, joint in mechanism.joints.items():
            for end in (joint.first, joint.second):
                body, _, point = end.partition(".")
                if body == name:
                    used.add(point)
                    places[joint_name] = complex(values[f"{end}.x"], values[f"{end}.y"])
        others = [point for point in mechanism.body(name).points if point not in used]
        for k, point in enumerate(others):
            places[f" {k}"] = complex(values[f"{name}.{point}.x"], values[f"{name}.{point}.y"])
        mass = (values.get(f"{name}.mass", 0.0), values.get(f"{name}.inertia", 0.0))
        if mass[0]:
            places[" centre"] = complex(
                values.get(f"{name}.center.x", 0.0), values.get(f"{name}.center.y", 0.0)
            )
        shapes[name] = places, mass
    return shapes


def _alike(
    one: tuple[dict[str, complex], tuple[float, ...]],
    two: tuple[dict[str, complex], tuple[float, ...]],
    joints: Mapping[str, str],
    mirrored: bool,
) -> bool:
    """Return whether a turn (or a mirror image) takes one link's places to the other's."""
    if len(one[0]) != len(two[0]) or one[1] != two[1]:
        return False
    try:
        pairs = [(place, two[0][joints.get(name, name)]) for name, place in one[0].items()]
    except KeyError:
        return False
    pairs = [(place.conjugate(), to) for place, to in pairs] if mirrored else pairs
    if len(pairs) < 2:
        return True
    far = max(range(len(pairs)), key=lambda k: abs(pairs[k][0] - pairs[0][0]))
    base, image = pairs[far][0] - pairs[0][0], pairs[far][1] - pairs[0][1]
    size = abs(base)
    if not isclose(size, abs(image), rel_tol=NEAR):
        return False
    turn = image / base if size else 1.0
    return all(
        abs((place - pairs[0][0]) * turn - (to - pairs[0][1])) <= NEAR * size for place, to in pairs
    )


def _same_joints(mechanism: Mechanism, joints: Mapping[str, str]) -> bool:
    """Return whether joints and those whose places they take have equal numbers."""
    values = mechanism.values()
    for name, to in joints.items():
        one = {entry: values[f"{name}.{entry}"] for entry, _ in mechanism.joints[name].numbers()}
        two = {entry: values[f"{to}.{entry}"] for entry, _ in mechanism.joints[to].numbers()}
        if one != two:
            return False
    return True
