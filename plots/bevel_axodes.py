"""A bevel wheel that rolls on a fixed one, and its axodes: the pitch cones."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save


def rolling() -> md.Mechanism:
    """Return a planet of 16 teeth on a cage, around a fixed wheel of 24; the axes meet in O."""
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0)}),
        bodies=[
            md.Body("cage", {"O": (0, 0, 0), "P": (0.04, 0, 0)}),
            md.Body("planet", {"P": (0, 0, 0), "T": (0, 0.026, 0)}),
            md.Body("wheel", {"O": (0, 0, 0)}),
        ],
        joints=[
            md.SpatialRevolute("C", "ground.O", "cage.O", axis=(0, 0, 1)),
            md.SpatialWeld("W", "ground.O", "wheel.O", axis=(0, 0, 1)),
            md.SpatialRevolute("O", "cage.O", "wheel.O", axis=(0, 0, 1)),
            md.SpatialRevolute("P", "cage.P", "planet.P", axis=(1, 0, 0)),
            md.SpatialGear("mesh", "wheel.O", "planet.P", carrier="cage", ratio="-16/24"),
        ],
        sketch={"C.angle": 0.0},
    )


def figure() -> Figure:
    """Return the figure."""
    driver = md.Driver("C.angle", from_=0.0, to=6.283185307179586)
    task = md.Sweep(driver=driver, poses=73, measures=["axodes"])
    problem = md.Problem(rolling(), {"turn": task}, title="Bevel planet on a fixed wheel")
    result = md.solve(problem, "turn")
    drawn = md.plot(result, "diagram", pose=64, axodes=["planet"], traces=False, view="25,25")
    whole = drawn.get_figure(root=True)
    assert isinstance(whole, Figure)
    return whole


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
