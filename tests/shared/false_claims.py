"""Certificates of which one claim is false, each of its own kind, and how many of them pass."""

from __future__ import annotations

import copy
import tempfile
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

from mechdae.errors import SolveError
from tests.shared.certified import certificate, checked

Change = Callable[[dict[str, Any]], None]


def passes(word: str, *changes: Change, refused: str = "") -> float:
    """Return how many false claims pass, or are refused for another reason."""
    missed = 0.0
    with tempfile.TemporaryDirectory() as folder:
        for change in changes:
            content = copy.deepcopy(certificate(word))
            change(content)
            try:
                checked(content, Path(folder))
                missed += 1
            except SolveError as error:
                missed += refused not in str(error)
    return missed


def zero_bounds() -> float:
    def change(content: Any) -> None:
        content["modes"][1]["bound"]["length"] = "0"

    return passes("modes", change, refused="further off than its bound")


def modes_left_out() -> float:
    return passes("geared", *(lambda content, k=k: content["modes"].pop(k) for k in range(4)))


def complex_poses_twice() -> float:
    """One that is not real stands in the place of another one."""

    def change(content: Any) -> None:
        poses = content["complex"]
        apart = [k for k, pose in enumerate(poses) if any(im != "0" for _, im in pose)]
        poses[apart[0]] = poses[apart[-1]]

    return passes("modes", change)


def steps_left_out() -> float:
    return passes("slides", *(lambda content, k=k: content["path"]["steps"].pop(k) for k in (0, 9)))


def poses_twice() -> float:
    return passes("slides", lambda content: content["poses"].insert(1, content["poses"][1]))


def joints_with_other_numbers() -> float:
    """Each number of a joint by 1e-6, of gears, racks, guides, slots, welds."""
    missed = 0.0
    for word in ("geared", "planetary-gear-train", "rack-and-pinion", "scotch-yoke"):
        for name, joint in certificate(word)["mechanism"]["joints"].items():
            for key in joint.keys() - {"kind", "first", "second", "carrier"}:
                if (word, key) == ("planetary-gear-train", "ratio"):
                    continue  # its wheels are at zero there

                def change(content: Any, name: str = name, key: str = key) -> None:
                    other = content["mechanism"]["joints"][name]
                    other[key] = str(Fraction(other[key]) + Fraction(1, 10**6))

                missed += passes(word, change)
    return missed


def axes_turned_round() -> float:
    """All products of a joint vanish as before."""

    def change(content: Any) -> None:
        joint = content["mechanism"]["joints"]["E"]
        joint["axis"] = [str(-Fraction(v)) for v in joint["axis"]]

    return passes("spatial modes", change, refused="an axis has the other sense")


def change_points_nearly_met() -> float:
    def change(content: Any) -> None:
        step = next(step for step in content["path"]["steps"] if "through" in step)
        step["through"]["bodies"]["rod"] = [f"1/{10**21}", "1", "-1"]

    return passes("folding", change, refused="do not vanish exactly")


def motions_nearly_met() -> float:
    def change(content: Any) -> None:
        waves = content["mechanism"]["motion"]["rod"][0]
        waves[-1][1] = str(Fraction(waves[-1][1]) + Fraction(1, 10**30))

    return passes("rod", change, refused="does not hold along the motion")


def modes_beside_boxes() -> float:
    def change(content: Any) -> None:
        del content["modes"][0]

    return passes("flyball-governor", change)


def contacts_left_out() -> float:
    return passes("contacts", *(lambda content, k=k: content["modes"].pop(k) for k in (0, 1)))


def tubes_without_inverse() -> float:
    """With nothing near the inverse of the Jacobian a tube proves nothing (Krawczyk 1969)."""
    from flint import arb, arb_mat

    from mechdae.parts.proof.checker import mechanism_of
    from mechdae.parts.proof.checker.arithmetic import ZERO, exact
    from mechdae.parts.proof.checker.tubes import Tube

    content = certificate("geared")
    m, missed = mechanism_of(content["mechanism"]), 0.0
    z = m.claimed(content["modes"][0], exact(content["at"], ""), "")
    inverse = arb_mat(m.dense(z, m.n)).inv().mid()
    Tube(m, z, ZERO, m.n, inverse)
    for factor in (-0.1, 0.0, 2.1):
        try:
            Tube(m, z, ZERO, m.n, inverse * arb(factor))
            missed += 1
        except ArithmeticError:
            pass
    return missed


def spins_of_what_is_held() -> float:
    """A tube between two balls does not spin where a bar or a vector holds it elsewhere."""

    def held(kind: str, **more: Any) -> Change:
        def change(content: Any) -> None:
            own = content["mechanism"]
            own["bodies"]["tube"]["H"] = ["1", "0", "0"]
            ends = {"kind": kind, "first": "ground.A", "second": "tube.H"}
            own["joints"]["holds"] = {**ends, **more}

        return change

    return passes(
        "spinning",
        held("distance", square="1"),
        held("vector", azimuth="0"),
        lambda content: content["mechanism"]["spins"][0].update(body="boom"),
        lambda content: content["mechanism"]["spins"][0].update(on="rod"),
        refused="does not spin",
    )


def other_spins() -> float:
    def change(content: Any) -> None:
        content["mechanism"]["spins"][0]["across"][0] = "0"

    return passes("spinning", change, lambda content: content["mechanism"].pop("spins"))


CLAIMS = (
    *(zero_bounds, modes_left_out, complex_poses_twice, steps_left_out, poses_twice),
    *(joints_with_other_numbers, axes_turned_round, change_points_nearly_met),
    *(motions_nearly_met, modes_beside_boxes, contacts_left_out, tubes_without_inverse),
    *(spins_of_what_is_held, other_spins),
)
