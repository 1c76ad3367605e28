"""Random loaded mechanisms in the plane and in space, with their own positions: what holds them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import mechdae as md
from tests.reference.virtual_work import (
    Burden,
    Frame,
    about,
    along,
    dyad,
    efforts,
    planar,
    rocker_angle,
)

HINGE = np.zeros(2)


@dataclass
class CacheOwner:
    """A mechanism, its drivers with their values, and its frames over these values."""

    mechanism: md.Mechanism
    drivers: dict[str, float]
    frames: Callable[[np.ndarray], dict[str, Frame]]
    burden: Burden

    def task(self, **keys: Any) -> md.Reactions:
        return md.Reactions(
            drivers=[md.Driver(name, at=[value], **keys) for name, value in self.drivers.items()]
        )

    def truth(self) -> tuple[np.ndarray, float]:
        """Return the efforts by virtual work, and a size of the forces."""
        u = np.array(list(self.drivers.values()))
        return efforts(self.frames, self.burden, u), self.burden.size(self.frames(u))

    def off(self) -> float:
        """Return how far the efforts of the package are off, as a share of the forces."""
        found = md.solve(self.mechanism, self.task())
        assert set(found.status) == {"ok"}
        truth, size = self.truth()
        gaps = [
            float(found.efforts[name][0]) - own
            for name, own in zip(self.drivers, truth, strict=True)
        ]
        return float(np.max(np.abs(gaps))) / size


def held(rng: np.random.Generator, family: str) -> CacheOwner:
    """Return a random loaded mechanism of a family."""
    while True:
        bodies, joints, ground, drivers, frames, sketched = FAMILIES[family](rng)
        u = np.array(list(drivers.values()))
        try:  # away from dead centres, and from angles that jump
            near = [frames(u + k * way) for way in 0.02 * np.eye(len(u)) for k in (-1, 0, 1)]
        except ValueError:
            continue
        turns = np.array([[own.angle for own in poses.values()] for poses in near])
        if np.abs(turns).max() < 3 and np.ptp(turns, axis=0).max() < 0.2:
            size = 2 if family in PLANAR else 3
            return loaded(rng, bodies, joints, ground, drivers, frames, sketched(u), size)


def loaded(
    rng: np.random.Generator, bodies: dict[str, dict[str, Any]], joints: list[Any],
    ground: dict[str, Any], drivers: dict[str, float], frames: Any, sketch: dict[str, float],
    size: int,
) -> CacheOwner:  # fmt: skip
    """Return a mechanism with masses, a push and a spring on each body that may have them."""
    burden = Burden(rng.normal(size=size) * 6)
    own, loads = [], list[Any]()
    ground = dict(ground)
    for name, points in bodies.items():
        keys: dict[str, Any] = {"points": {**points}}
        bar = size == 3 and name == "rod"
        line = np.array(points["C"]) if bar else None
        local = rng.uniform(-0.4, 0.4, size) if line is None else rng.uniform(0.2, 0.8) * line
        mass = float(rng.uniform(0.5, 4))
        centre = rng.uniform(-0.4, 0.4, size) if line is None else rng.uniform(0.2, 0.8) * line
        moment: Any = 0.3 if size == 2 or bar else (0.2, 0.3, 0.25)
        moment = (0.1, 0.1, 0.1) if bar else moment
        keys |= {"mass": mass, "center": tuple(centre), "inertia": moment}
        burden.masses[name] = (mass, centre)
        push, point = rng.normal(size=size) * 10, local
        keys["points"]["P"] = tuple(point)
        loads.append(md.Force(f"push_{name}", point=f"{name}.P", value=tuple(push)))
        burden.pushes.append((name, point, push))
        anchor = rng.uniform(-2, 2, size)
        ground[f"A_{name}"] = tuple(anchor)
        k, free, preload = rng.uniform(5, 30), rng.uniform(0.2, 1.0), rng.uniform(0, 5)
        loads.append(
            md.Spring(
                f"spring_{name}", between=(f"ground.A_{name}", f"{name}.P"), stiffness=k,
                free_length=free, preload=preload, damping=7.0,
            )
        )  # fmt: skip
        burden.springs.append((anchor, name, point, k, free, preload))
        if size == 2:
            burden.torques[name] = float(rng.normal() * 3)
            loads.append(md.Torque(f"twist_{name}", body=name, value=burden.torques[name]))
        own.append(md.Body(name, **keys))
    mechanism = md.Mechanism(
        ground=md.Ground(points=ground), bodies=own, joints=joints, loads=loads,
        gravity=tuple(burden.gravity), sketch=sketch, dimension=size,
    )  # fmt: skip
    return CacheOwner(mechanism, drivers, frames, burden)


# -- families --------------------------------------------------------------------------------------


def _angles(frames: Any) -> Any:
    return lambda u: {name: own.angle for name, own in frames(u).items()}


def _four_bar(rng: Any) -> tuple[Any, ...]:
    r, b, c = rng.uniform(0.3, 0.6), rng.uniform(0.9, 1.4), rng.uniform(0.8, 1.2)
    D, side, turn = np.array([rng.uniform(0.8, 1.3), rng.uniform(-0.3, 0.3)]), 1, rng.uniform(-2, 2)

    def frames(u: np.ndarray) -> dict[str, Frame]:
        B = r * np.array([np.cos(u[0]), np.sin(u[0])])
        C = dyad(B, D, b, c, side)
        return {"crank": planar(HINGE, u[0]), "coupler": along(B, C), "rocker": along(D, C)}

    bodies = {
        "crank": {"O": (0, 0), "B": (r, 0)}, "coupler": {"B": (0, 0), "C": (b, 0)},
        "rocker": {"D": (0, 0), "C": (c, 0)},
    }  # fmt: skip
    joints = [
        md.Revolute("O", "ground.O", "crank.O"), md.Revolute("B", "crank.B", "coupler.B"),
        md.Revolute("C", "coupler.C", "rocker.C"), md.Revolute("D", "ground.D", "rocker.D"),
    ]  # fmt: skip
    ground = {"O": (0, 0), "D": tuple(D)}
    return bodies, joints, ground, {"crank.angle": turn}, frames, _angles(frames)


def _six_bar(rng: Any) -> tuple[Any, ...]:
    bodies, joints, ground, drivers, first, _ = _four_bar(rng)
    e, f = rng.uniform(0.8, 1.3, 2)
    E, G = rng.uniform(-0.5, 0.5, 2), np.array([rng.uniform(0.5, 1.5), rng.uniform(-1.2, -0.6)])
    bodies = {**bodies, "link": {"E": (0, 0), "F": (e, 0)}, "arm": {"G": (0, 0), "F": (f, 0)}}
    bodies["coupler"] = {**bodies["coupler"], "E": tuple(E)}

    def frames(u: np.ndarray) -> dict[str, Frame]:
        found = first(u)
        start = found["coupler"].place(E)
        F = dyad(start, G, e, f, -1)
        return {**found, "link": along(start, F), "arm": along(G, F)}

    joints = [
        *joints, md.Revolute("E", "coupler.E", "link.E"), md.Revolute("F", "link.F", "arm.F"),
        md.Revolute("G", "ground.G", "arm.G"),
    ]  # fmt: skip
    return bodies, joints, {**ground, "G": tuple(G)}, drivers, frames, _angles(frames)


def _ram(rng: Any) -> tuple[Any, ...]:
    k, H = rng.uniform(0.8, 1.5), np.array([rng.uniform(0.3, 0.8), rng.uniform(-0.8, -0.3)])
    length = rng.uniform(0.8, 1.4)

    def frames(u: np.ndarray) -> dict[str, Frame]:
        K = dyad(HINGE, H, k, u[0], 1)
        tube = along(H, K)
        return {"boom": along(HINGE, K), "tube": tube, "rod": planar(K, tube.angle)}

    bodies = {
        "boom": {"O": (0, 0), "K": (k, 0)}, "tube": {"H": (0, 0)}, "rod": {"K": (0, 0)}
    }  # fmt: skip
    joints = [
        md.Revolute("O", "ground.O", "boom.O"), md.Revolute("H", "ground.H", "tube.H"),
        md.Revolute("K", "boom.K", "rod.K"), md.Prismatic("ram", "tube.H", "rod.K"),
    ]  # fmt: skip
    ground = {"O": (0, 0), "H": tuple(H)}
    sketched = lambda u: {**_angles(frames)(u), "ram": u[0]}  # noqa: E731
    return bodies, joints, ground, {"ram.slide": length}, frames, sketched


def _slider_crank(rng: Any) -> tuple[Any, ...]:
    r, b, e = rng.uniform(0.3, 0.6), rng.uniform(0.9, 1.5), rng.uniform(-0.2, 0.2)
    tilt, turn = rng.uniform(-1, 1), rng.uniform(-2, 2)
    way = np.array([np.cos(tilt), np.sin(tilt)])
    G = e * np.array([-way[1], way[0]])

    def frames(u: np.ndarray) -> dict[str, Frame]:
        B = r * np.array([np.cos(u[0]), np.sin(u[0])])
        w = B - G
        high = b**2 - (w @ w - (w @ way) ** 2)
        if high <= 0.05:
            raise ValueError("the rod does not reach")
        C = G + (w @ way + np.sqrt(high)) * way
        return {"crank": planar(HINGE, u[0]), "rod": along(B, C), "slider": planar(C, tilt)}

    bodies = {
        "crank": {"O": (0, 0), "B": (r, 0)}, "rod": {"B": (0, 0), "C": (b, 0)},
        "slider": {"C": (0, 0)},
    }  # fmt: skip
    joints = [
        md.Revolute("O", "ground.O", "crank.O"), md.Revolute("B", "crank.B", "rod.B"),
        md.Revolute("C", "rod.C", "slider.C"),
        md.Prismatic("guide", "ground.G", "slider.C", axis=tilt, turn=tilt),
    ]  # fmt: skip
    ground = {"O": (0, 0), "G": tuple(G)}
    sketched = lambda u: {k: v for k, v in _angles(frames)(u).items() if k != "slider"}  # noqa: E731
    return bodies, joints, ground, {"crank.angle": turn}, frames, sketched


def _unit(rng: Any) -> np.ndarray:
    found = rng.normal(size=3)
    return np.asarray(found / np.linalg.norm(found))


def _across(axis: np.ndarray) -> np.ndarray:
    """Return a unit vector square to another one."""
    found = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    return np.asarray(found / np.linalg.norm(found))


def _hinge(name: str, first: str, second: str, axis: np.ndarray) -> Any:
    zero = _across(axis)
    return md.SpatialRevolute(name, first, second, axis=axis, zero=zero, axis2=axis, zero2=zero)


def _rssr(rng: Any) -> tuple[Any, ...]:
    a, d = _unit(rng), _unit(rng)
    b, c = 0.5 * _unit(rng), 0.9 * _unit(rng)
    D, rod, side = rng.uniform(-0.6, 0.6, 3), rng.uniform(0.8, 1.2), int(rng.choice((-1, 1)))
    turn = rng.uniform(-2, 2)

    def frames(u: np.ndarray) -> dict[str, Frame]:
        B = about(a, u[0]) @ b
        q = rocker_angle(B, D, d, c, rod, side)
        rocker = Frame(D, about(d, q), q)
        C = rocker.place(c)
        x = (C - B) / rod
        y = _across(x)
        bar = Frame(B, np.stack([x, y, np.cross(x, y)], axis=1))
        return {"crank": Frame(np.zeros(3), about(a, u[0])), "rod": bar, "rocker": rocker}

    bodies = {
        "crank": {"O": (0, 0, 0), "B": tuple(b)}, "rod": {"B": (0, 0, 0), "C": (rod, 0, 0)},
        "rocker": {"D": (0, 0, 0), "C": tuple(c)},
    }  # fmt: skip
    joints = [
        _hinge("O", "ground.O", "crank.O", a), md.Spherical("B", "crank.B", "rod.B"),
        md.Spherical("C", "rocker.C", "rod.C"), _hinge("D", "ground.D", "rocker.D", d),
    ]  # fmt: skip
    ground = {"O": (0, 0, 0), "D": tuple(D)}
    sketched = lambda u: {"D.angle": frames(u)["rocker"].angle}  # noqa: E731
    return bodies, joints, ground, {"O.angle": turn}, frames, sketched


def _arm(rng: Any) -> tuple[Any, ...]:
    axes = [_unit(rng) for _ in range(3)]
    arms = [rng.uniform(0.3, 0.8) * _unit(rng) for _ in range(2)]
    turns, names = rng.uniform(-2, 2, 3), ("one", "two", "three")

    def frames(u: np.ndarray) -> dict[str, Frame]:
        found, origin, R = {}, np.zeros(3), np.eye(3)
        for k, name in enumerate(names):
            R = R @ about(axes[k], u[k])
            found[name] = Frame(origin, R)
            origin = origin + R @ (arms[k] if k < 2 else np.zeros(3))
        return found

    bodies = {
        "one": {"O": (0, 0, 0), "A": tuple(arms[0])}, "two": {"A": (0, 0, 0), "B": tuple(arms[1])},
        "three": {"B": (0, 0, 0)},
    }  # fmt: skip
    ends = (("ground.O", "one.O"), ("one.A", "two.A"), ("two.B", "three.B"))
    joints = [_hinge(f"J{k}", *ends[k], axes[k]) for k in range(3)]
    drivers = {f"J{k}.angle": float(turns[k]) for k in range(3)}
    return bodies, joints, {"O": (0, 0, 0)}, drivers, frames, lambda u: {}


PLANAR: dict[str, Any] = {
    "four-bar": _four_bar, "six-bar": _six_bar, "ram": _ram, "slider-crank": _slider_crank
}  # fmt: skip
SPATIAL: dict[str, Any] = {"rssr": _rssr, "arm": _arm}
FAMILIES = PLANAR | SPATIAL
