"""Random mechanisms with links that spin freely: poses that close, forces that balance.

python -m tests.attack.idle_links --count 200

A lever on a hinge is moved by a cylinder between two balls, or a crank moves a lever by a rod that
has a third joint on its line, or by two rods whose common ball two bars hold. Weights lie on the
lines of what spins. To some of them come free rollers on hinges and balls, or a second machine with
weights that nothing drives: neither may change anything. The truth is of its own: places of points
that keep the lengths, and the equilibrium of all bodies with the forces that each joint can pass,
found by least squares.
"""

from __future__ import annotations

import argparse
import collections
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import mechdae as md
from mechdae.equations.mobility import count_mobility
from tests.shared.paths import ROOT

LINKS = ("cylinder", "sleeve", "third joint", "knee", "bent")
KINDS = (*LINKS, "rollers", "second machine")
G = np.array([0, 0, -9.81])
CLOSED, BALANCED, REGULAR, REACH = 1e-10, 1e-8, 0.2, 0.02


@dataclass
class Case:
    """A mechanism, its driver, and what its links weigh: shares of two points, and mass.

    ``whole`` is the mechanism with the bodies that are `loose`.
    """

    mechanism: md.Mechanism
    driver: str
    weights: dict[str, tuple[str, str, float, float]]
    spinning: tuple[str, ...]
    bars: dict[str, tuple[str, str, float]] = field(default_factory=dict)
    whole: md.Mechanism | None = None
    loose: tuple[str, ...] = ()


def near(rng: Any, *place: float) -> Any:
    return rng.uniform(-1, 1, 3) + np.array(place)


def axis_of(rng: Any) -> Any:
    way = rng.normal(size=3)
    return way / np.linalg.norm(way)


def lever(name: str, pin: Any, tip: Any, mass: float) -> md.Body:
    return md.Body(name, {"O": pin, "T": tip}, mass=mass, center=(pin + tip) / 2)


def moved(axis: Any, pin: Any, tip: Any, by: Any) -> float:
    """Return how fast the tip of a lever leaves a point: not near zero where it is regular."""
    return abs(float(np.cross(axis, tip - pin) @ (tip - by))) / float(np.linalg.norm(tip - by))


def drawn(rng: Any, kind: str) -> Case:
    """Return a random mechanism of a kind, in a pose that is regular."""
    if kind == "rollers":
        return with_rollers(rng, drawn(rng, str(rng.choice(LINKS))))
    if kind == "second machine":
        found, other = drawn(rng, str(rng.choice(LINKS[:4]))), drawn(rng, str(rng.choice(LINKS)))
        return with_machine(found, other.mechanism)
    while True:
        found, regular = _drawn(rng, kind)
        if min(regular) > REGULAR:
            return found


def _drawn(rng: Any, kind: str) -> tuple[Case, list[float]]:
    """Return a random mechanism, and what must not be near zero in its pose."""
    A, T, C = near(rng, 0, 0, 0), near(rng, 1.5, 0, 0), near(rng, 0, 2, 0)
    mass = {name: float(rng.uniform(0.5, 3)) for name in ("lever", "first", "second")}
    ground = {"A": A, "C": C}
    bodies = [lever("lever", A, T, mass["lever"])]
    axis = axis_of(rng)
    joints: list[Any] = [md.SpatialRevolute("A", "ground.A", "lever.O", axis=axis)]
    if kind in ("cylinder", "sleeve", "bent"):
        M = C + rng.uniform(0.3, 0.7) * (T - C)
        way = (T - C) / np.linalg.norm(T - C)
        if kind == "bent":
            M, way = M + rng.uniform(-0.3, 0.3, 3), axis_of(rng)
        heavy = kind != "bent"
        share = rng.uniform(0.1, 0.9, 2)
        own: list[dict[str, Any]] = [{}, {}]
        if heavy:
            own = [
                {"mass": mass[n], "center": C + s * (T - C)}
                for n, s in zip(("first", "second"), share, strict=True)
            ]
        bodies += [
            md.Body("first", {"C": C, "M": M}, **own[0]),
            md.Body("second", {"T": T, "M": M}, **own[1]),
        ]
        pair = md.Cylindrical if kind == "sleeve" else md.SpatialPrismatic
        joints += [
            md.Spherical("C", "ground.C", "first.C"),
            pair("S", "first.M", "second.M", axis=way),
            md.Spherical("T", "second.T", "lever.T"),
        ]
        ends = ("first.C", "second.T")
        size = float(np.linalg.norm(T - C))
        weights = {"lever": ("lever.O", "lever.T", 0.5, mass["lever"])}
        if heavy:  # each keeps its distance from its own end
            weights["first"] = (*ends, share[0] * size, mass["first"])
            weights["second"] = (*ends[::-1], (1 - share[1]) * size, mass["second"])
        mechanism = built(ground, bodies, joints)
        regular = [moved(axis, A, T, C), abs(float(way @ (T - C)))]
        return Case(mechanism, "S.slide", weights, ("first", "second")), regular
    B, K = C + rng.uniform(0.3, 0.6, 3), near(rng, 0.7, 1, 1.2)
    bodies.append(lever("crank", C, B, 1.0))
    joints.append(md.SpatialRevolute("C", "ground.C", "crank.O", axis=axis_of(rng)))
    weights = {
        "lever": ("lever.O", "lever.T", 0.5, mass["lever"]),
        "crank": ("crank.O", "crank.T", 0.5, 1.0),
    }
    ground["D"], share = near(rng, 0, 0, 2), float(rng.uniform(0.2, 0.8))
    if kind == "third joint":
        P = B + share * (T - B)
        hinge, Q = axis_of(rng), P + rng.uniform(-0.6, 0.6, 3)
        ground["E"] = near(rng, 0.5, -1.5, 0)
        bodies += [
            md.Body("first", {"B": B, "T": T, "P": P}, mass=mass["first"], center=P),
            lever("third", ground["E"], Q, 1.0),
        ]
        joints += [
            md.Spherical("B", "crank.T", "first.B"),
            md.Spherical("T", "first.T", "lever.T"),
            md.SpatialRevolute("E", "ground.E", "third.O", axis=hinge),
            md.Distance("D", "third.T", "first.P", length=float(np.linalg.norm(Q - P))),
        ]
        weights["first"] = ("first.B", "first.T", share, mass["first"])
        weights["third"] = ("third.O", "third.T", 0.5, 1.0)
        bars = {"D": ("third.T", "first.P", float(np.linalg.norm(Q - P)))}
        regular = [moved(axis, A, T, B), moved(hinge, ground["E"], Q, P)]
        return Case(built(ground, bodies, joints), "C.angle", weights, ("first",), bars), regular
    ground["E"] = near(rng, 1.5, 1.5, -1)
    lengths = [float(np.linalg.norm(K - ground[n])) for n in "DE"]
    bodies += [
        md.Body("first", {"B": B, "K": K}, mass=mass["first"], center=B + share * (K - B)),
        md.Body("second", {"K": K, "T": T}, mass=mass["second"], center=(K + T) / 2),
    ]
    joints += [
        md.Spherical("B", "crank.T", "first.B"),
        md.Spherical("K", "first.K", "second.K"),
        md.Spherical("T", "second.T", "lever.T"),
        md.Distance("D", "ground.D", "second.K", length=lengths[0]),
        md.Distance("E", "ground.E", "second.K", length=lengths[1]),
    ]
    weights["first"] = ("first.B", "first.K", share, mass["first"])
    weights["second"] = ("second.K", "second.T", 0.5, mass["second"])
    bars = {n: (f"ground.{n}", "second.K", size) for n, size in zip("DE", lengths, strict=True)}
    ways = [(K - at) / np.linalg.norm(K - at) for at in (B, ground["D"], ground["E"])]
    regular = [moved(axis, A, T, K), abs(float(np.linalg.det(ways)))]
    spun = ("first", "second")
    return Case(built(ground, bodies, joints), "C.angle", weights, spun, bars), regular


def built(ground: Any, bodies: Any, joints: Any) -> md.Mechanism:
    return md.Mechanism(
        dimension=3,
        frames="drawn",
        gravity=G,
        ground=md.Ground(ground),
        bodies=bodies,
        joints=joints,
    )


def with_rollers(rng: Any, found: Case) -> Case:
    """Return a case with bodies that hang on one hinge or ball each, somewhere."""
    own = found.mechanism
    places = {f"ground.{name}": at for name, at in own.ground.points.items()}
    places |= {f"{n}.{p}": at for n, body in own.bodies.items() for p, at in body.points.items()}
    bodies, joints = list(own.bodies.values()), list(own.joints.values())
    names = tuple(f"roller{k}" for k in range(int(rng.integers(1, 4))))
    for name in names:
        pin = str(rng.choice(list(places)))
        at = np.array(places[pin], float)
        bodies.append(md.Body(name, {"O": at, "R": at + rng.normal(size=3)}))
        ends = f"pin_{name}", pin, f"{name}.O"
        hinge = rng.uniform() < 0.7
        joints.append(
            md.SpatialRevolute(*ends, axis=axis_of(rng)) if hinge else md.Spherical(*ends)
        )
    order = rng.permutation(len(bodies)), rng.permutation(len(joints))
    whole = built(own.ground.points, [bodies[k] for k in order[0]], [joints[k] for k in order[1]])
    return replace(found, whole=whole, loose=names)


def with_machine(found: Case, other: md.Mechanism) -> Case:
    """Return a case with another one beside it, which shares nothing but the ground."""
    own = found.mechanism

    def second(name: str) -> str:
        body, _, point = name.partition(".")
        return f"ground.other_{point}" if body == "ground" else f"other_{name}"

    ground = dict(own.ground.points) | {f"other_{n}": at for n, at in other.ground.points.items()}
    bodies = [replace(body, name=second(body.name)) for body in other.bodies.values()]
    joints = [
        replace(j, name=second(j.name), first=second(j.first), second=second(j.second))
        for j in other.joints.values()
    ]
    whole = built(ground, [*bodies, *own.bodies.values()], [*joints, *own.joints.values()])
    return replace(found, whole=whole, loose=tuple(body.name for body in bodies))


def tube_with_ball(hand: str) -> float:
    """Return the effort of a cylinder between two balls, with a body on a ball beside its line."""
    problem = md.load(ROOT / "tests/data/spatial/cylinder-between-two-balls.toml")
    mechanism = problem.mechanism
    bodies, joints = dict(mechanism.bodies), list(mechanism.joints.values())
    if hand:
        tube = bodies["tube"]
        bodies["tube"] = replace(tube, points={**tube.points, "X": (0, 0, 0.1)})
        bodies[hand] = md.Body(hand, {"O": [0, 0, 0.1], "R": [0.2, 0, 0]})
        joints.append(md.Spherical("wrist", "tube.X", f"{hand}.O"))
    mechanism = replace(mechanism, bodies=bodies, joints=joints)
    task = md.Reactions(driver=md.Driver("cyl.slide", at=[0.0], speed=0.0))
    try:
        return float(md.solve(mechanism, task).efforts["cyl.slide"][0])
    except md.MechdaeError:
        return np.inf


class Seen:
    """What a pose of a result says: places of points."""

    def __init__(self, found: Case, result: Any, k: int) -> None:
        self.case, self.mechanism, self.result, self.k = found, found.mechanism, result, k

    def place(self, point: str) -> Any:
        body, _, name = point.partition(".")
        if body == "ground":
            return np.array(self.mechanism.ground.points[name], float)
        return self.result.points[point].position[self.k]

    def centre(self, name: str) -> Any:
        """Return where a link weighs: on the line of two points, at a share or a distance."""
        one, other, share, _ = self.case.weights[name]
        start, way = self.place(one), self.place(other) - self.place(one)
        sliding = one.split(".")[0] != other.split(".")[0]
        return start + way * (share / np.linalg.norm(way) if sliding else share)

    def gap(self) -> float:
        """Return by how much points miss what the links and joints say of them."""
        drawn_at = {
            f"{name}.{point}": np.array(at, float)
            for name, body in self.mechanism.bodies.items()
            for point, at in body.points.items()
        }
        worst = [0.0]
        for name, body in self.mechanism.bodies.items():
            known = [f"{name}.{p}" for p in body.points if f"{name}.{p}" in self.result.points]
            for one in known:
                for other in known:
                    now = np.linalg.norm(self.place(one) - self.place(other))
                    worst.append(abs(now - np.linalg.norm(drawn_at[one] - drawn_at[other])))
        for joint in self.mechanism.joints.values():
            if joint.kind == "spherical":
                worst.append(np.abs(self.place(joint.first) - self.place(joint.second)).max())
            if joint.kind == "revolute":
                axis, pin = np.array(joint.axis, float), self.place(joint.first)
                tip = joint.second_body + ".T"
                worst.append(np.abs(self.place(joint.second) - pin).max())
                moved = self.place(tip) - drawn_at[tip]
                worst.append(abs(float(axis @ moved)))
        for one, other, size in self.case.bars.values():
            worst.append(abs(np.linalg.norm(self.place(one) - self.place(other)) - size))
        if self.case.driver == "S.slide":
            worst.append(abs(self._slid() - self.result.drivers["S.slide"].position[self.k]))
        return max(worst)

    def _slid(self) -> float:
        """Return how far the cylinder has slid, by the distance of its balls."""
        joint = self.mechanism.joints["S"]
        way, u = np.array(joint.axis, float), 0.0
        bodies = self.mechanism.bodies
        c, t = (np.array(bodies[b].points[p], float) for b, p in (("first", "C"), ("second", "T")))
        size = np.linalg.norm(self.place("second.T") - self.place("first.C"))
        for _ in range(30):
            gap = t + u * way - c
            u -= (gap @ gap - size**2) / (2 * gap @ way)
        return u

    def imbalance(self) -> tuple[float, Any]:
        """Return what is left of the equilibrium, and forces of joints and bars that are unique.

        Spinning bodies of a cylinder are one: what they pass to each other is inside.
        """
        part = {name: name for name in self.mechanism.bodies}
        if self.case.driver == "S.slide":
            part["second"] = "first"
        rows = {name: 6 * i for i, name in enumerate(dict.fromkeys(part.values()))}
        columns: list[Any] = []
        owners: list[tuple[str, int]] = []

        def acting(body: str, place: Any, force: Any, moment: Any = (0, 0, 0)) -> Any:
            own = np.zeros(6 * len(rows))
            if body in part:
                at = rows[part[body]]
                own[at : at + 3], own[at + 3 : at + 6] = force, np.cross(place, force) + moment
            return own

        for name, joint in self.mechanism.joints.items():
            if joint.kind in ("spherical", "revolute"):
                place = self.place(joint.first)
                for k, way in enumerate(np.eye(3)):
                    pair = acting(joint.second_body, place, way)
                    columns.append(pair - acting(joint.first_body, place, way))
                    owners.append((name, k))
            if joint.kind == "revolute":
                turned = np.eye(3) if f"{name}.angle" == self.case.driver else _across(joint.axis)
                for moment in turned:
                    pair = acting(joint.second_body, np.zeros(3), np.zeros(3), moment)
                    columns.append(pair)
                    owners.append((name, 3))
        for name, (one, other, _) in self.case.bars.items():
            first, second = self.place(one), self.place(other)
            way = (second - first) / np.linalg.norm(second - first)
            pair = acting(other.split(".")[0], second, way)
            columns.append(pair - acting(one.split(".")[0], first, way))
            owners.append((name, 0))
        load = sum(
            acting(name, self.centre(name), weight[3] * G)
            for name, weight in self.case.weights.items()
        )
        M = np.array(columns).T
        found = np.linalg.lstsq(M, -load, rcond=1e-10)[0]
        left = float(np.abs(M @ found + load).max())
        return left, {own: value for own, value in zip(owners, found, strict=True) if own[1] < 3}


def _across(axis: Any) -> Any:
    return np.linalg.svd(np.array(axis, float)[None])[2][1:]


def judged(rng: Any, kind: str) -> collections.Counter[str]:
    """Return how the poses of a random mechanism fare."""
    found, words = drawn(rng, kind), collections.Counter[str]()
    task = md.Reactions(driver=md.Driver(found.driver, from_=-REACH, to=REACH, speed=0.0), poses=3)
    if kind == "second machine":
        own = found.mechanism
        points = (f"{name}.{p}" for name, body in own.bodies.items() for p in body.points)
        task = replace(task, outputs=(*points, *own.joints))
    try:
        result = md.solve(found.whole or found.mechanism, task)
    except md.MechdaeError as error:
        words[f"{type(error).__name__}: {error.what[:70]}"] += 1
        return words
    named = " ".join(count_mobility(found.mechanism)["idle"])
    words["not named"] += not all(name in named for name in found.spinning)
    named = " ".join([*result.summary["not_in_scene"], *result.summary.get("notes", ())])
    words["not named"] += not all(name in named for name in found.loose)
    words["not left out"] += any(name in result.bodies for name in (*found.spinning, *found.loose))
    for k, status in enumerate(result.status):
        words[str(status)] += 1
        if status != "ok":
            continue
        seen = Seen(found, result, k)
        words["open"] += seen.gap() > CLOSED
        left, forces = seen.imbalance()
        words["no balance"] += left > BALANCED
        size = max(1.0, *map(abs, forces.values()))
        for (name, own), value in forces.items():
            joint = found.mechanism.joints[name]
            if joint.kind == "distance":
                one, other, _ = found.bars[name]
                way = seen.place(other) - seen.place(one)
                told = result.joints[name].reaction[k][:3] @ way / np.linalg.norm(way)
            else:
                told = result.joints[name].reaction[k][own]
            words["wrong force"] += abs(told - value) > BALANCED * size
    return words


def run(count: int, seed: int, kinds: tuple[str, ...] = KINDS) -> collections.Counter[str]:
    rng, words = np.random.default_rng(seed), collections.Counter[str]()
    for i in range(count):
        own = judged(rng, kinds[i % len(kinds)])
        words += own
        bad = {w: n for w, n in own.items() if w != "ok" and n}
        if bad:
            print(i, kinds[i % len(kinds)], bad, flush=True)
    return words


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(dict(run(options.count, options.seed)))


if __name__ == "__main__":
    main()
