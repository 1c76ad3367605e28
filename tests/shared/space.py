"""Spatial mechanisms of the reference data, and the data themselves."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

import mechdae as md
from tests.reference.spatial_designs import turned
from tests.shared.paths import DATA


def reference(name: str) -> dict[str, Any]:
    """Return a file of reference data; its numbers are decimal strings."""
    data: dict[str, Any] = json.loads((DATA / "spatial" / f"{name}.json").read_text("utf-8"))
    return data


def numbers(value: Any) -> Any:
    """Return decimal strings as an array."""
    return np.array(value, dtype=float)


def off(ours: Any, wanted: Any) -> float:
    """Return the largest difference over the largest component."""
    wanted = numbers(wanted)
    return float(np.abs(np.asarray(ours) - wanted).max() / np.abs(wanted).max())


def bearing(kind: Any, name: str, p: dict[str, Any], side: str, between: tuple[str, str]) -> Any:
    """Return a joint on the ground whose body's z is the axis, its x the normal."""
    axis, zero = numbers(p[f"axis_{side}"]), numbers(p[f"normal_{side}"])
    return kind(name, *between, axis=axis, zero=zero, axis2=[0, 0, 1], zero2=[1, 0, 0])


def rssr(p: dict[str, Any], **more: Any) -> md.Mechanism:
    """Return crank, bar with two ball joints and rocker of the data; `more` keys of bodies."""
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": numbers(p["A"]), "D": numbers(p["D"])}),
        bodies=[
            md.Body("crank", {"A": [0, 0, 0], "B": numbers(p["B"])}, **more.get("crank", {})),
            md.Body("bar", {"B": [0, 0, 0], "C": [float(p["l"]), 0, 0]}, **more.get("bar", {})),
            md.Body("rocker", {"D": [0, 0, 0], "C": numbers(p["C"])}, **more.get("rocker", {})),
        ],
        joints=[
            bearing(md.SpatialRevolute, "A", p, "A", ("ground.A", "crank.A")),
            md.Spherical("B", "crank.B", "bar.B"),
            md.Spherical("C", "rocker.C", "bar.C"),
            bearing(md.SpatialRevolute, "D", p, "D", ("ground.D", "rocker.D")),
        ],
    )


def rssp(p: dict[str, Any]) -> md.Mechanism:
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": numbers(p["A"]), "G": numbers(p["G"])}),
        bodies=[
            md.Body("crank", {"A": [0, 0, 0], "B": numbers(p["B"])}),
            md.Body("bar", {"B": [0, 0, 0], "C": [float(p["l"]), 0, 0]}),
            md.Body("slider", {"G": [0, 0, 0], "C": numbers(p["C"])}),
        ],
        joints=[
            bearing(md.SpatialRevolute, "A", p, "A", ("ground.A", "crank.A")),
            md.Spherical("B", "crank.B", "bar.B"),
            md.Spherical("C", "slider.C", "bar.C"),
            bearing(md.SpatialPrismatic, "G", p, "G", ("ground.G", "slider.G")),
        ],
    )


def cardan(p: dict[str, Any]) -> md.Mechanism:
    pins = {"axis": numbers(p["pin_in"]), "axis2": numbers(p["pin_out"])}
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": [0, 0, 0]}),
        bodies=[md.Body("input", {"O": [0, 0, 0]}), md.Body("output", {"O": [0, 0, 0]})],
        joints=[
            bearing(md.SpatialRevolute, "I", p, "in", ("ground.O", "input.O")),
            bearing(md.SpatialRevolute, "E", p, "out", ("ground.O", "output.O")),
            md.Universal("U", "input.O", "output.O", **pins),
        ],
    )


def double_cardan(p: dict[str, Any]) -> md.Mechanism:
    first = {"axis": numbers(p["pin_in"]), "axis2": numbers(p["pin_mid1"])}
    second = {"axis": numbers(p["pin_mid2"]), "axis2": numbers(p["pin_out"])}
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": numbers(p["O1"]), "G": numbers(p["G_out"])}),
        bodies=[
            md.Body("input", {"O": [0, 0, 0]}),
            md.Body("middle", {"O": [0, 0, 0], "P": [0, 0, float(p["L"])]}),
            md.Body("output", {"P": [0, 0, 0]}),
        ],
        joints=[
            bearing(md.SpatialRevolute, "I", p, "in", ("ground.O", "input.O")),
            md.Universal("U", "input.O", "middle.O", **first),
            md.Universal("V", "middle.P", "output.P", **second),
            bearing(md.Cylindrical, "E", p, "out", ("ground.G", "output.P")),
        ],
    )


def bennett(p: dict[str, Any]) -> md.Mechanism:
    """Return Bennett's mechanism with the angles of Denavit and Hartenberg."""
    x, z = [1, 0, 0], [0, 0, 1]

    def joint(name: str, first: str, second: str, turn: str, back: str = "") -> Any:
        axis = [0, f"-sin({turn})", f"cos({turn})"] if turn else z
        axis2 = [0, f"sin({back})", f"cos({back})"] if back else z
        return md.SpatialRevolute(name, first, second, axis=axis, zero=x, axis2=axis2, zero2=x)

    return md.Mechanism(
        dimension=3,
        parameters={
            "a": float(p["a"]),
            "b": float(p["b"]),
            "alpha": float(p["alpha"]),
            "beta": "asin(b*sin(alpha)/a)",
        },
        ground=md.Ground({"P": [0, 0, 0], "S": ["-b", 0, 0]}),
        bodies=[
            md.Body("one", {"P": [0, 0, 0], "Q": ["a", 0, 0]}),
            md.Body("two", {"Q": [0, 0, 0], "R": ["b", 0, 0]}),
            md.Body("three", {"R": [0, 0, 0], "S": ["a", 0, 0]}),
        ],
        joints=[
            joint("P", "ground.P", "one.P", ""),
            joint("Q", "one.Q", "two.Q", "alpha"),
            joint("R", "two.R", "three.R", "beta"),
            joint("S", "three.S", "ground.S", "alpha", "beta"),
        ],
    )


def sarrus(p: dict[str, Any]) -> md.Mechanism:
    """Return a platform on two chains of three parallel hinges in vertical planes."""
    ground, bodies, joints = {}, [], []
    platform = {}
    for k, chain in enumerate(p["chains"], start=1):
        turn = float(chain["angle"])
        out = np.array([round(np.cos(turn)), round(np.sin(turn)), 0.0])
        axis = [out[1], -out[0], 0.0]  # from the outward direction towards z
        ground[f"A{k}"] = float(chain["e"]) * out
        platform[f"C{k}"] = float(chain["f"]) * out
        sides = {"axis": axis, "zero": out, "axis2": [0, 0, 1], "zero2": [1, 0, 0]}
        back = {"axis": [0, 0, 1], "zero": [1, 0, 0], "axis2": axis, "zero2": out}
        bodies += [
            md.Body(f"low{k}", {"A": [0, 0, 0], "B": [float(chain["l1"]), 0, 0]}),
            md.Body(f"high{k}", {"B": [0, 0, 0], "C": [float(chain["l2"]), 0, 0]}),
        ]
        joints += [
            md.SpatialRevolute(f"A{k}", f"ground.A{k}", f"low{k}.A", **sides),
            md.SpatialRevolute(f"B{k}", f"low{k}.B", f"high{k}.B", axis=[0, 0, 1]),
            md.SpatialRevolute(f"C{k}", f"high{k}.C", f"platform.C{k}", **back),
        ]
    return md.Mechanism(
        dimension=3,
        ground=md.Ground(ground),
        bodies=[*bodies, md.Body("platform", {"O": [0, 0, 0], **platform})],
        joints=joints,
    )


def ring_of_seven(rng, backwards=False):
    """Return seven hinges in a ring that closes at angles drawn at random, the first one, places.

    Every second joint is written from its later body to its earlier one where that is asked for.
    """
    places, axes = rng.normal(size=(7, 3)), rng.normal(size=(7, 3))
    angles = rng.uniform(-2, 2, size=7)
    # bodies are drawn in the pose of zero angles; the last hinge's ground side is where it gets
    T = [np.eye(4)]
    for P, a, v in zip(places, axes, angles, strict=True):
        M = np.eye(4)
        M[:3, :3] = turned(a, v)
        M[:3, 3] = P - M[:3, :3] @ P
        T.append(T[-1] @ M)
    last = T[-2]
    end, axis = last[:3, :3] @ places[6] + last[:3, 3], last[:3, :3] @ axes[6]
    ground = {"P0": tuple(places[0]), "P6": tuple(end)}
    bodies = [
        md.Body(f"b{k + 1}", {f"P{k}": tuple(places[k]), f"P{k + 1}": tuple(places[k + 1])})
        for k in range(6)
    ]
    joints = []
    names = ["ground", *(body.name for body in bodies), "ground"]
    for k in range(7):
        sides = [f"{names[k]}.P{k}", f"{names[k + 1]}.P{k}"]
        here = there = tuple(axes[k])
        if k == 6:
            there = tuple(axis)
        if backwards and k % 2:
            sides, here, there = sides[::-1], there, here
        joints.append(md.SpatialRevolute(f"J{k}", *sides, axis=here, axis2=there))
    mechanism = md.Mechanism(
        dimension=3, ground=md.Ground(ground), bodies=bodies, joints=joints, sketch={}
    )
    world = np.array([T[k][:3, :3] @ places[k] + T[k][:3, 3] for k in range(1, 7)])
    return mechanism, angles[0], world
