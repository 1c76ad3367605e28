"""Mechanisms of the package as those of `tests.reference.gaps`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.tasks.constraints import LimitConstraint
from mechdae.describe.tasks.goals import Minimise
from tests.reference.gaps import Array, Drive, Open, Pair, Side

R, L = 0.1, 0.3
"""Crank and rod of a slider-crank on the line of its crank."""
C, G = 2e-5, 5e-5
"""Clearance of its pins and of its guide."""
TURN = md.Driver("crank.angle", from_=0.5, to=0.5 + 2 * np.pi)
KINDS = {
    "revolute": "pin", "prismatic": "guide", "pin-in-slot": "slot", "distance": "bar",
    "gear": "gear", "rack": "rack", "weld": "weld",
}  # fmt: skip


def in_lengths() -> md.Mechanism:
    """The slider-crank with the lengths r and l as parameters, a clearance in its guide."""
    whole = replace(slider_crank(clearance=G), parameters={"c": C, "l": L, "r": R})
    rod, crank = whole.bodies["rod"], whole.bodies["crank"]
    rod = replace(rod, points={"B": (0, 0), "C": ("l", 0)})
    crank = replace(crank, points={"O": (0, 0), "B": ("r", 0)})
    return replace(whole, bodies={**whole.bodies, "rod": rod, "crank": crank})


def least_rod(most: float) -> md.Problem:
    """The design of the shortest rod whose angle has a sine up to `most`, looked at 37 times."""
    plain, path = in_lengths(), "turn/outputs/square/value"
    joints = {**plain.joints, "guide": md.Prismatic("guide", "ground.O", "slider.C")}
    whole = replace(plain, joints=joints, outputs={"square": "sin(rod.angle)**2"})
    task = md.Synthesis(
        driver={"coordinate": "crank.angle"}, goal=Minimise(of="turn/points/rod.C/position"),
        free={"l": (0.15, 0.6)}, constraints=(LimitConstraint(of=path, max=most**2),), starts=1,
    )  # fmt: skip
    turn = md.Sweep(md.Driver("crank.angle", from_=0.0, to=2 * np.pi), poses=37)
    return md.Problem(whole, {"turn": turn, "design": task})


def slider_crank(**guide: float) -> md.Mechanism:
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "B": (R, 0)}),
            md.Body("rod", {"B": (0, 0), "C": (L, 0)}),
            md.Body("slider", {"C": (0, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O", clearance=C),
            md.Revolute("B", "crank.B", "rod.B", clearance="c"),
            md.Revolute("C", "rod.C", "slider.C", clearance=C),
            md.Prismatic("guide", "ground.O", "slider.C", **guide),
        ],
        parameters={"c": C},
        sketch={"crank": 0.5, "rod": -0.1, "guide": 0.35},
    )


def open_mechanism(mechanism: md.Mechanism, drivers: list[str]) -> tuple[Open, list[str]]:
    """Return a mechanism with its gaps, and its bodies in order."""
    bodies, values = list(mechanism.bodies), mechanism.values()

    def side(reference: str) -> Side:
        body, _ = reference.split(".")
        place = bodies.index(body) if body in bodies else -1
        return Side(place, values[f"{reference}.x"], values[f"{reference}.y"])

    pairs = []
    for name, joint in mechanism.joints.items():
        number = {key: values.get(f"{name}.{key}", 0.0) for key in ("axis", "turn", "phase")}
        gap = values.get(f"{name}.clearance", 0.0)
        length = values.get(f"{name}.length", 0.0)
        if joint.kind == "prismatic":
            length = values.get(f"{name}.contact_length", 0.0)
        if joint.kind == "rack":
            length, gap = values[f"{name}.radius"], values.get(f"{name}.backlash", 0.0) / 2
        ratio = values.get(f"{name}.ratio", 1.0)
        if joint.kind == "gear":
            gap = values.get(f"{name}.backlash_angle", 0.0) / 2
        carrier = getattr(joint, "carrier", None)
        pairs.append(
            Pair(
                KINDS[joint.kind], side(joint.first), side(joint.second), gap, length=length,
                ratio=ratio, carrier=bodies.index(carrier) if carrier in bodies else -1, **number,
            )
        )  # fmt: skip
    drives = []
    for text in drivers:
        owner, _, word = text.rpartition(".")
        if owner in bodies:
            drives.append(Drive("angle", Side(-1), Side(bodies.index(owner))))
        else:
            joint = mechanism.joints[owner]
            axis = values.get(f"{owner}.axis", 0.0)
            drives.append(Drive(word, side(joint.first), side(joint.second), axis))
    return Open(len(bodies), pairs, drives), bodies


def poses_of(result: md.SweepResult, bodies: list[str]) -> Array:
    """Return x, y of the origin and angle of each body, (n, 3 bodies)."""
    values, columns = result.mechanism.values(), []
    for body in bodies:
        angle = result.bodies[body].angle
        point = next(p for p in result.points if p.split(".")[0] == body)
        local = np.array([values[f"{point}.x"], values[f"{point}.y"]])
        c, s = np.cos(angle), np.sin(angle)
        arm = np.stack([c * local[0] - s * local[1], s * local[0] + c * local[1]], axis=1)
        columns.append(np.column_stack([result.points[point].position - arm, angle]))
    return np.concatenate(columns, axis=1)


GAPS = {
    "revolute": ("clearance",), "pin-in-slot": ("clearance",),
    "prismatic": ("clearance", "contact_length"), "gear": ("backlash_angle",),
    "rack": ("backlash",),
}  # fmt: skip
"""Keys of the gap of a kind of joint, and of the length of a block."""


def with_gaps(mechanism: md.Mechanism, share: float) -> md.Mechanism:
    """Return a mechanism with gaps of a share of its size, its blocks a fifth of it long."""
    joints = {}
    for name, joint in mechanism.joints.items():
        sizes = (share * (1.0 if joint.kind == "gear" else mechanism.scale), 0.2 * mechanism.scale)
        changes = dict(zip(GAPS.get(joint.kind, ()), sizes, strict=False))
        joints[name] = replace(joint, **changes)
    return replace(mechanism, joints=joints)


@dataclass
class Comparison:
    """Bands beside what adversaries reach: one ratio for each, and counts.

    Of samples, those outside of a band or ``open``, where offsets do not let a mechanism close;
    of bands, those that fall ``short``, of which less is reached than is told, and not proved ones.
    """

    ratios: list[float] = field(default_factory=list)
    outside: int = 0
    short: int = 0
    samples: int = 0
    open: int = 0
    bands: int = 0
    unbounded: int = 0

    def add(
        self, band: float, reached: float, deviations: Array, closed: Array, size: float
    ) -> None:
        """Enter the deviations of samples from a place, towards both ends of its band."""
        self.samples += len(deviations)
        self.open += int((~closed).sum())
        furthest = float(np.abs(deviations[closed]).max(initial=0.0))
        rounding = 1e-13 * size
        self.outside += int((np.abs(deviations[closed]) > band + rounding).sum())
        self.short += int(reached > furthest + 1e-6 * band + rounding)
        if band > 1e4 * rounding:
            self.ratios.append(band / max(furthest, rounding))

    def join(self, further: Comparison) -> None:
        """Enter what another comparison counted."""
        self.ratios += further.ratios
        for count in ("outside", "short", "samples", "open", "bands", "unbounded"):
            setattr(self, count, getattr(self, count) + getattr(further, count))


def compared(
    result: md.SweepResult, seed: int, poses: int, samples: int, rounds: int = 4
) -> Comparison:
    """Compare the bands of points and bodies with adversaries at some poses."""
    mechanism, rng = result.mechanism, np.random.default_rng(seed)
    closed, bodies = open_mechanism(mechanism, list(result.drivers))
    q, values, found = poses_of(result, bodies), mechanism.values(), Comparison()
    u = np.column_stack([series.position for series in result.drivers.values()])
    fine = np.flatnonzero(np.isin(result.status, ("ok", "limit")) & np.isfinite(q).all(axis=1))

    def of_point(side: Side, axis: int, sign: int) -> Callable[[Array], tuple[Array, Array]]:
        def output(x: Array) -> tuple[Array, Array]:
            place, slope = closed.point(x, side)
            return sign * place[:, axis], sign * slope[:, axis]

        return output

    def of_angle(body: int, sign: int) -> Callable[[Array], tuple[Array, Array]]:
        def output(x: Array) -> tuple[Array, Array]:
            angle, slope = closed.angle(x, body)
            return sign * angle, sign * slope

        return output

    for k in fine[np.unique(np.linspace(0, len(fine) - 1, poses).round().astype(int))]:
        wanted = []
        for point, series in result.points.items():
            body = bodies.index(point.split(".")[0])
            side = Side(body, values[f"{point}.x"], values[f"{point}.y"])
            for axis in range(2):
                outputs = [of_point(side, axis, sign) for sign in (1, -1)]
                arrays = (series.position, series.position_band, series.position_reached)
                wanted.append((outputs, *[a[k, axis] for a in arrays], mechanism.scale))
        for body, name in enumerate(bodies):
            series = result.bodies[name]
            arrays = (series.angle, series.angle_band, series.angle_reached)
            outputs = [of_angle(body, sign) for sign in (1, -1)]
            wanted.append((outputs, *[a[k] for a in arrays], 1.0))
        for outputs, place, band, reached, size in wanted:
            found.bands += 1
            if not np.isfinite(band):
                found.unbounded += 1
                continue
            drawn = [
                closed.worst(q[k], u[k], output, closed.random(rng, samples), rounds)
                for output in outputs
            ]
            deviations = [
                value - sign * place for (value, _), sign in zip(drawn, (1, -1), strict=True)
            ]
            there = np.concatenate([good for _, good in drawn])
            found.add(band, reached, np.concatenate(deviations), there, size)
    return found


def drawn_mechanism(rng: np.random.Generator, dyads: int) -> md.Mechanism:
    """Return a crank with dyads of pins, guides and slots, drawn where its angle is 0."""
    places: dict[str, dict[str, Array]] = {"ground": {}, "crank": {}}
    joints: list[Any] = []

    def put(body: str, place: Array) -> str:
        name = f"P{sum(map(len, places.values()))}"
        places.setdefault(body, {})[name] = place
        return f"{body}.{name}"

    def pin(first: str, second: str, place: Array) -> None:
        joints.append(md.Revolute(f"J{len(joints)}", put(first, place), put(second, place)))

    origin = rng.normal(size=2)
    pin("ground", "crank", origin)
    movers = ["crank"]
    for k in range(dyads):
        base = movers[-1] if k == 0 else movers[rng.integers(len(movers))]
        start = rng.normal(size=2) if k else origin + rng.uniform(0.3, 1) * _unit(rng)
        sort = rng.choice(["pins", "guide", "slot"], p=[0.5, 0.3, 0.2])
        one, two = f"a{k}", f"b{k}"
        if sort == "slot":
            turn = rng.uniform(0, np.pi)
            pin("ground", one, rng.normal(size=2))
            first, second = put(one, start - 0.2 * _unit(turn)), put(base, start)
            joints.append(md.PinInSlot(f"J{len(joints)}", first, second, axis=turn))
            movers += [one]
            continue
        middle = start + rng.uniform(0.6, 1.6) * _unit(rng)
        pin(base, one, start)
        pin(one, two, middle)
        if sort == "guide":
            turn = rng.uniform(0, np.pi)
            first, second = put("ground", middle - 0.3 * _unit(turn)), put(two, middle)
            joints.append(md.Prismatic(f"J{len(joints)}", first, second, axis=turn))
            movers += [one]
        else:
            pin("ground", two, middle + rng.uniform(0.6, 1.6) * _unit(rng))
            movers += [one, two]
    ground = md.Ground({name: tuple(place) for name, place in places.pop("ground").items()})
    bodies, sketch = [], {"crank": 0.0}
    for body, points in places.items():
        anchor = next(iter(points.values()))
        bodies.append(md.Body(body, {name: tuple(p - anchor) for name, p in points.items()}))
        sketch[body] = 0.0
        for name, place in points.items():
            sketch[f"{body}.{name}.x"], sketch[f"{body}.{name}.y"] = map(float, place)
    return md.Mechanism(ground=ground, bodies=bodies, joints=joints, sketch=sketch)


def _unit(turn: np.random.Generator | float) -> Array:
    angle = turn if isinstance(turn, float) else turn.uniform(0, 2 * np.pi)
    return np.array([np.cos(angle), np.sin(angle)])


def two_wheels() -> md.Mechanism:
    """A pair of wheels whose pitch circles are of 20 and 40 mm, with backlash of 0.1 mm."""
    return md.Mechanism(
        ground=md.Ground({"A": (0, 0), "B": (0.06, 0)}),
        bodies=[md.Body("crank", {"A": (0, 0)}), md.Body("wheel", {"B": (0, 0)})],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "ground.B", "wheel.B"),
            md.Gear("teeth", "crank.A", "wheel.B", ratio=-2.0, backlash=1e-4),
        ],
        sketch={"crank": 0.5, "wheel": -0.25},
    )
