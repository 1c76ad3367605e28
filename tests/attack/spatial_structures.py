"""Spatial structures drawn at random: pairs in loops, bodies and dimensions that close them.

A structure is what two mechanisms have in common; each has many sets of dimensions, of which part
are nearly singular. What is drawn are a pose and the joints' frames in it, in 80 bits; the
dimensions of the bodies are these, rounded to doubles.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mechdae as md
from tests.reference.dual_quaternions import (
    EXACT,
    FREEDOMS,
    TURN,
    Loops,
    Mesh,
    Pair,
    frame,
    length,
    moved,
    place_of,
    product,
    times,
    turned_back,
    vector_by,
)

KINDS = {
    "R": md.SpatialRevolute,
    "P": md.SpatialPrismatic,
    "C": md.Cylindrical,
    "H": md.Screw,
    "U": md.Universal,
    "S": md.Spherical,
    "E": md.PlanarPair,
    "W": md.SpatialWeld,
}
WORDS = {
    "R": ("angle",),
    "P": ("slide",),
    "H": ("angle",),
    "C": ("angle", "slide"),
    "U": ("angle", "angle2"),
    "E": ("x", "y", "angle"),
}
NEAR = ("parallel", "meeting", "folded")
"""What nearly happens where it is asked for: two axes in line, two joints in one place, or three
joints in line, by 1e-9 to 1e-2 of what it is elsewhere."""


@dataclass(frozen=True)
class Joint:
    """A joint of a structure: its letter, and its bodies as numbers; D is a bar without a body."""

    letter: str
    first: int
    second: int


@dataclass
class Structure:
    """Joints in an order that places bodies, the driven freedom's joint and word, a mesh.

    ``meshed`` are the joints of the wheels, or of rack and wheel, on ``carrier``; ``axes`` says how
    those of two wheels lie: parallel, meeting, or anyhow.
    """

    joints: list[Joint]
    bodies: int
    driven: tuple[int, str]
    mesh: str = ""
    meshed: tuple[int, int] = (0, 0)
    name: str = ""
    order: int = 0
    carrier: int = 0
    axes: str = ""

    @property
    def senses(self) -> tuple[int, int]:
        """Senses of the joints of a mesh: 1 of a joint that leads from the carrier to a wheel."""
        first, second = (1 if self.joints[k].first == self.carrier else -1 for k in self.meshed)
        return first, second

    @property
    def hub(self) -> bool:
        """Whether a body hangs on bars alone."""
        return any(joint.letter == "F" for joint in self.joints)

    @property
    def idle(self) -> set[int]:
        """Bodies between two ball joints and nothing else."""
        own: dict[int, list[str]] = {}
        for joint in self.joints:
            for body in (joint.first, joint.second):
                own.setdefault(body, []).append(joint.letter)
        return {body for body, letters in own.items() if body and letters == ["S", "S"]}


@dataclass
class Drawn:
    """Sets of dimensions of a structure: the closure of all, the mechanism of each.

    ``points`` are (name, body, local (k, 3)); lengths are in units of ``unit`` (k,) metres.
    """

    structure: Structure
    loops: Loops
    start: tuple[Any, Any]
    mechanisms: list[md.Mechanism]
    unit: Any
    near: list[str]
    points: list[tuple[str, int, Any]] = field(default_factory=list)
    values: dict[int, Any] = field(default_factory=dict)


def freedoms(letter: str) -> int:
    return 5 if letter == "D" else len(FREEDOMS[letter])


def chain(rng: Any, wanted: int, last: str = "") -> str:
    """Return letters whose freedoms are a number, with a spin more for a link between balls."""
    while True:
        letters = last
        while sum(map(freedoms, letters)) < wanted + 2 and len(letters) < 7:
            letters += str(rng.choice(list("RRRPPHCCUUSSSED")))
            if rng.uniform() < 0.04:
                letters += "W"
            balls = letters.count("SS")
            if sum(map(freedoms, letters)) == wanted + balls and balls < 2:
                if len(letters) > 2 and "SSS" not in letters and letters[-1] != "W":
                    return letters
                break


def structure(rng: Any, wheels: bool = False) -> Structure:
    """Return any structure of one freedom, on one or two loops; with wheels alone if asked for."""
    while True:
        found = _wheels(rng) if wheels else _structure(rng)
        if sound(found, rng):
            return found


AXES = {"=": "parallel", "^": "meeting", "": ""}


def _wheels(rng: Any) -> Structure:
    """Return a loop with wheels: driven by one, held by one, or with one on its first link."""
    how, sign = str(rng.choice(["driven", "held", "planet"])), str(rng.choice(list(AXES)))
    order, mesh = int(rng.integers(-18, 11)), "k" if sign == "" and rng.uniform() < 0.5 else "g"
    kind = {"g": "R", "k": "P"}[mesh]
    if how == "driven":
        letters = chain(rng, 7, "R")
    elif how == "planet":
        letters = chain(rng, 8, "R" + kind)
    else:
        letters = chain(rng, 8, "R")
        while letters[-1] != kind:
            letters = chain(rng, 8, "R")
    count = len(letters)
    joints = [Joint(x, k, (k + 1) % count) for k, x in enumerate(letters)]
    bodies, driven, carrier, meshed = count - 1, (0, "angle"), 0, (count - 1, 0)
    if how == "driven":
        joints.append(Joint(kind, 0, count))
        meshed, bodies = (count, 0), count
        driven = (count, "angle" if mesh == "g" else "slide")
    if how == "planet":
        meshed, carrier = (1, 0), 1
    word = {"driven": mesh, "held": mesh.upper(), "planet": f"o{mesh}"}[how]
    name = f"{word}{sign}-{letters}"
    return Structure(joints, bodies, driven, mesh, meshed, name, order, carrier, AXES[sign])


def _structure(rng: Any) -> Structure:
    kind = str(
        rng.choice(["loop", "two", "wheel", "coupled", "plate"], p=[0.4, 0.35, 0.1, 0.1, 0.05])
    )
    order = int(rng.integers(-18, 11))
    if kind == "plate":  # a plate on six bars, one of them on a crank
        legs = [Joint("D", int(k == 0), 2) for k in range(6)]
        joints = [Joint("R", 0, 1), Joint("F", 0, 2), *legs]
        return Structure(joints, 2, (0, "angle"), name="plate", order=order)
    first = str(rng.choice(list("RRRPHCU")))
    letters = chain(rng, 8 if kind == "coupled" else 7, first)
    count = len(letters)
    joints = [Joint(x, k, (k + 1) % count) for k, x in enumerate(letters)]
    driven, name, bodies = (0, str(rng.choice(WORDS[first]))), letters, count - 1
    mesh, meshed = "", (0, 0)
    if first == "E" or first == "U":
        driven = (0, "angle")
    if kind == "two":
        more = chain(rng, 6)
        start, end = rng.choice(count, 2, replace=False)
        ways = [int(start), *range(count, count + len(more) - 1), int(end)]
        joints += [Joint(x, ways[k], ways[k + 1]) for k, x in enumerate(more)]
        bodies, name = bodies + len(more) - 1, f"{letters}+{more}@{start}{end}"
    if kind == "wheel":
        mesh = str(rng.choice(["g", "k"]))
        joints.append(Joint("R" if mesh == "g" else "P", 0, bodies + 1))
        meshed, bodies = (len(joints) - 1, 0), bodies + 1
        driven, name = (meshed[0], "angle" if mesh == "g" else "slide"), f"{mesh}-{letters}"
        if first != "R":
            return _structure(rng)
    if kind == "coupled":
        mesh = {"R": "G", "P": "K"}.get(letters[-1], "")
        meshed, name = (count - 1, 0), f"{mesh}-{letters}"
        if not mesh or first != "R":
            return _structure(rng)
    return Structure(joints, bodies, driven, mesh, meshed, name, order)


def sound(found: Structure, rng: Any) -> bool:
    """Return whether the structure moves with its driver alone, at a pose drawn at random."""
    drawn = draw(found, rng, 3, near=0.0, mechanisms=False)
    loops, (c, spins) = drawn.loops, drawn.start
    _, gaps, slopes = loops.placed(c, spins)
    J = slopes[..., loops.free]
    idle = len(found.idle)
    if J.shape[2] - idle != J.shape[1] or np.abs(gaps).max() > 1e-12:
        return False
    sizes = np.linalg.svd(J, compute_uv=False)
    return bool((sizes[:, -1] > 1e-4 * sizes[:, 0]).any())


def draw(
    found: Structure, rng: Any, sets: int, near: float = 0.3, mechanisms: bool = True
) -> Drawn:
    """Return sets of dimensions of a structure, a share of them nearly singular."""
    count = len(found.joints)
    places = rng.uniform(-1, 1, (sets, count, 3))
    turns = _turn(rng, (sets, count))
    if found.hub:
        near = 0.0
    words = [str(rng.choice(NEAR)) if rng.uniform() < near else "" for _ in range(sets)]
    if found.axes:
        _aligned(rng, found, places, turns)
    for i, word in enumerate(words):
        if word:
            strain(rng, word, places[i], turns[i])
    bodies = [_still(sets)]
    bodies += [
        moved(_turn(rng, (sets,)), rng.uniform(-1, 1, (sets, 3)).astype(EXACT))
        for _ in range(found.bodies)
    ]
    values = {k: _values(rng, j.letter, sets) for k, j in enumerate(found.joints)}
    pitches = rng.uniform(0.1, 0.5, (sets, count)) * rng.choice([-1, 1], (sets, count))
    size = rng.choice([-1, 1], sets) * rng.uniform(0.4, 1.6, sets)
    local: dict[tuple[int, int, str], Any] = {}
    for k, joint in enumerate(found.joints):
        own = moved(turns[:, k], places[:, k].astype(EXACT))
        if joint.letter == "F":
            local[k, 0, "s"] = local[k, 1, "s"] = np.zeros((sets, 3))
            continue
        if joint.letter == "D":
            away = places[:, k] + rng.uniform(-1, 1, (sets, 3))
            local[k, 0, "s"] = _local(bodies[joint.first], places[:, k])
            local[k, 1, "s"] = _local(bodies[joint.second], away)
            continue
        other = times(own, _play(joint.letter, values[k], pitches[:, k]))
        for side, (body, at) in enumerate(((joint.first, own), (joint.second, other))):
            inside = times(turned_back(bodies[body]), at)
            local[k, side, "s"] = place_of(inside).astype(float)
            axes = {w: _axis(inside, i).astype(float) for w, i in (("x", 0), ("z", 2))}
            crossed = joint.letter == "U" and side == 1
            local[k, side, "axis"] = axes["x" if crossed else "z"]
            local[k, side, "zero"] = axes["z" if crossed else "x"]
    lengths = {
        k: length(
            _world(bodies[j.second], local[k, 1, "s"]) - _world(bodies[j.first], local[k, 0, "s"])
        )
        for k, j in enumerate(found.joints)
        if j.letter == "D"
    }
    numbers = {"pitch": pitches, "size": size, "local": local, "values": values}
    numbers["length"] = {k: whole[:, 0].astype(float) for k, whole in lengths.items()}
    loops, start = closure(found, numbers, bodies)
    drawn = Drawn(found, loops, start, [], np.ones(sets), words)
    drawn.points, drawn.values = _points(rng, found, local, sets), values
    if mechanisms:
        for i in range(sets):
            own_mechanism, unit = mechanism(drawn, numbers, bodies, i)
            drawn.mechanisms.append(own_mechanism)
            drawn.unit[i] = unit
    return drawn


def _aligned(rng: Any, found: Structure, places: Any, turns: Any) -> None:
    """Put the wheels' axes parallel, of either sense, or through one point."""
    a, b = found.meshed
    if found.axes == "parallel":
        half = rng.uniform(-np.pi, np.pi, len(turns)).astype(EXACT) / 2
        over = rng.integers(0, 2, len(turns)).astype(EXACT)
        zero = np.zeros(len(turns), EXACT)
        about = np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)
        flip = np.stack([1 - over, over, zero, zero], axis=-1)
        turns[:, a] = product(product(turns[:, b], about), flip)
        return
    along = rng.uniform(-1, 1, (2, len(turns), 1))
    axes = [vector_by(turns[:, k], np.array([0, 0, 1], EXACT)).astype(float) for k in (a, b)]
    places[:, a] = places[:, b] + along[0] * axes[1] - along[1] * axes[0]


def strain(rng: Any, word: str, places: Any, turns: Any) -> None:
    """Move one joint to where the mechanism is nearly singular."""
    k, share = int(rng.integers(1, len(places))), 10.0 ** rng.uniform(-9, -2)
    if word == "parallel":
        axis = rng.normal(size=3)
        axis *= np.sin(share / 2) / np.linalg.norm(axis)
        turns[k] = product(np.array([np.cos(share / 2), *axis]), turns[k - 1].astype(float))
    elif word == "meeting":
        places[k] = places[k - 1] + share * (places[k] - places[k - 1])
    else:
        after = places[(k + 1) % len(places)]
        way = places[k - 1] + rng.uniform(0.3, 1.7) * (after - places[k - 1])
        places[k] = way + share * (places[k] - way)


def closure(found: Structure, numbers: Any, bodies: list[Any]) -> tuple[Loops, tuple[Any, Any]]:
    """Return the loops of the rounded dimensions, and the pose that was drawn."""
    local, pairs = numbers["local"], []
    still = np.array([1, 0, 0, 0], EXACT)
    quarter = np.array([np.sqrt(EXACT(0.5)), 0, np.sqrt(EXACT(0.5)), 0], EXACT)
    for k, joint in enumerate(found.joints):
        sides = []
        for side in (0, 1):
            s = local[k, side, "s"].astype(EXACT)
            turn = np.broadcast_to(still, (len(s), 4))
            if joint.letter not in "DSF":
                turn = frame(*(local[k, side, w].astype(EXACT) for w in ("axis", "zero")))
            if joint.letter == "U" and side == 1:  # its axis is the second pin, which is x here
                turn = product(turn, quarter)
            sides.append(moved(turn, s))
        number = None
        if joint.letter == "H":
            number = numbers["pitch"][:, k].astype(EXACT) / TURN
        if joint.letter == "D":
            number = numbers["length"][k].astype(EXACT)
        pairs.append(Pair(joint.letter, joint.first, joint.second, *sides, number))
    meshes = []
    if found.mesh:
        last, first = found.meshed
        sense, second = found.senses
        angle, other = (numbers["values"][k][:, 0] for k in found.meshed)
        numbers["phase"] = sense * angle - second * numbers["size"] * other
        size, phase = (sense * numbers[w].astype(EXACT) for w in ("size", "phase"))
        meshes = [Mesh((last, 0), (first, 0), second * size, phase)]
    k, word = found.driven
    place = WORDS[found.joints[k].letter].index(word)
    loops = Loops(pairs, (k, place), meshes)
    c, spins = loops.read(dict(enumerate(bodies)), told(found, loops, numbers["values"]))
    return loops, (loops.at(c, numbers["values"][k][:, place]), spins)


def told(found: Structure, loops: Loops, values: Any) -> dict[int, Any]:
    """Return what coordinates are near, by their columns."""
    return {
        loops.column((k, i)): values[k][:, i]
        for k, joint in enumerate(found.joints)
        for i in range(len(WORDS.get(joint.letter, ())))
    }


def mechanism(drawn: Drawn, numbers: Any, bodies: list[Any], i: int) -> tuple[md.Mechanism, float]:
    """Return one of the mechanisms, and its unit of length in metres."""
    found, unit = drawn.structure, 2.0**drawn.structure.order
    made = _mechanism(drawn, numbers, bodies, i, unit)
    if made.order != unit:  # the power of two that lengths are divided by is part of a structure
        unit *= unit / made.order
        made = _mechanism(drawn, numbers, bodies, i, unit)
    assert made.order == 2.0**found.order
    return made, unit


def _mechanism(drawn: Drawn, numbers: Any, bodies: list[Any], i: int, unit: float) -> md.Mechanism:
    found, local = drawn.structure, numbers["local"]
    names = ["ground", *(f"b{k}" for k in range(1, found.bodies + 1))]
    points: dict[str, dict[str, Any]] = {name: {} for name in names}
    sketch: dict[str, Any] = {}
    for name, body, s in drawn.points:
        points[names[body]][name] = (s[i] * unit).tolist()
        if body and body not in found.idle:
            sketch[f"{names[body]}.{name}"] = _told(bodies[body], s, i, unit)
    joints: list[Any] = []
    for k, joint in enumerate(found.joints):
        if joint.letter == "F":
            continue
        ends = [f"{names[b]}.P{k}{'ab'[n]}" for n, b in enumerate((joint.first, joint.second))]
        if joint.letter == "D":
            whole = float(numbers["length"][k][i]) * unit
            joints.append(md.Distance(f"J{k}", *ends, length=whole))
        else:
            keys: dict[str, Any] = {}
            if joint.letter != "S":
                for word, side, entry in (
                    ("axis", 0, "axis"), ("zero", 0, "zero"), ("axis2", 1, "axis"),
                    ("zero2", 1, "zero"),
                ):  # fmt: skip
                    keys[word] = local[k, side, entry][i].tolist()
            if joint.letter == "H":
                keys["pitch"] = float(numbers["pitch"][i, k]) * unit
            joints.append(KINDS[joint.letter](f"J{k}", *ends, **keys))
            for n, word in enumerate(WORDS.get(joint.letter, ())):
                value = float(numbers["values"][k][i, n])
                if word.startswith("angle"):
                    sketch[f"J{k}.{word}"] = value
                elif k == found.driven[0] and word == found.driven[1]:
                    sketch[f"J{k}.{word}"] = value * unit
        for n, body in enumerate((joint.first, joint.second)):
            if body in found.idle:
                sketch[ends[n]] = _told(bodies[body], local[k, n, "s"], i, unit)
    if found.mesh:
        joints.append(_mesh(found, names, numbers, i, unit))
    return md.Mechanism(
        dimension=3,
        ground=md.Ground(points["ground"]),
        bodies=[md.Body(name, points[name]) for name in names[1:]],
        joints=joints,
        sketch=sketch,
    )


def _mesh(found: Structure, names: list[str], numbers: Any, i: int, unit: float) -> Any:
    far, near = (
        f"{names[j.second if j.first == found.carrier else j.first]}.P{k}"
        f"{'b' if j.first == found.carrier else 'a'}"
        for k, j in ((k, found.joints[k]) for k in found.meshed)
    )
    size, phase = float(numbers["size"][i]), float(numbers["phase"][i])
    carrier = names[found.carrier] if found.carrier else None
    if found.mesh in "gG":
        return md.SpatialGear("mesh", far, near, ratio=size, phase=phase, carrier=carrier)
    size, phase = size * unit, phase * unit
    return md.SpatialRack("mesh", near, far, radius=size, phase=phase, carrier=carrier)


def _points(rng: Any, found: Structure, local: Any, sets: int) -> list[tuple[str, int, Any]]:
    """Return the joints' points and one more on each body that does not spin."""
    own = []
    for k, joint in enumerate(found.joints):
        if joint.letter == "F":
            continue
        for side, body in enumerate((joint.first, joint.second)):
            own.append((f"P{k}{'ab'[side]}", body, local[k, side, "s"]))
    for body in range(1, found.bodies + 1):
        if body not in found.idle:
            own.append(("Q", body, rng.uniform(-1, 1, (sets, 3))))
    return own


def _values(rng: Any, letter: str, sets: int) -> Any:
    """Return values of a joint's coordinates at the pose that is drawn."""
    columns = [
        rng.uniform(-3, 3, sets) if freedom.split()[0] in ("turn", "screw")
        else rng.uniform(-1, 1, sets)
        for freedom in (FREEDOMS[letter] if letter not in "SF" else ())
    ]  # fmt: skip
    return np.stack(columns, axis=1) if columns else np.zeros((sets, 0))


def _play(letter: str, values: Any, pitch: Any) -> Any:
    """Return the motion of a joint by its values."""
    zero = np.zeros(len(pitch), EXACT)
    still, rot = np.stack([zero] * 3, axis=1), np.stack([zero + 1, zero, zero, zero], axis=1)
    whole = moved(rot, still)
    for n, freedom in enumerate(FREEDOMS[letter] if letter != "S" else ()):
        word, axis = freedom.split()
        half, value = values[:, n].astype(EXACT) / 2, values[:, n].astype(EXACT)
        shift, turn, i = still.copy(), rot.copy(), "xyz".index(axis)
        if word in ("turn", "screw"):
            turn[:, 0], turn[:, 1 + i] = np.cos(half), np.sin(half)
        if word == "shift":
            shift[:, i] = value
        if word == "screw":
            shift[:, i] = value * pitch.astype(EXACT) / TURN
        whole = times(whole, moved(turn, shift))
    return whole


def _turn(rng: Any, shape: Any) -> Any:
    q = rng.normal(size=(*shape, 4)).astype(EXACT)
    return q / length(q)


def _still(sets: int) -> Any:
    one = np.zeros((sets, 8), EXACT)
    one[:, 0] = 1
    return one


def _axis(p: Any, i: int) -> Any:
    unit = np.zeros((len(p), 3), p.dtype)
    unit[:, i] = 1
    return vector_by(p[:, :4], unit)


def _world(body: Any, s: Any) -> Any:
    return vector_by(body[:, :4], s) + place_of(body)


def _local(body: Any, place: Any) -> Any:
    back = turned_back(body)
    return (vector_by(back[:, :4], place.astype(EXACT)) + place_of(back)).astype(float)


def _told(body: Any, s: Any, i: int, unit: float) -> list[float]:
    place = _world(body[i : i + 1], s[i : i + 1].astype(EXACT))[0]
    return (place.astype(float) * unit).tolist()
