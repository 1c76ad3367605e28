"""Mechanisms with forces for the tests of reactions, as values."""

from __future__ import annotations

from typing import Any

import mechdae as md

S1 = {
    "r": 0.1,
    "l": 0.3,
    "r_O": 0.020,
    "r_B": 0.015,
    "r_C": 0.010,
    "f": 0.1,
    "f_slide": 0.12,
    "Q_work": 1000.0,
    "Q_return": 200.0,
}
INERTIA = {"m_rod": 1.2, "I_rod": 0.01, "c_rod": 0.1, "m_slider": 2.0}


def slider_crank(
    inertia: bool = False,
    load: md.Force | md.Resistance | None = None,
    gravity: tuple[float, float] | None = None,
    masses: dict[str, float] | None = None,
    contact_length: float | None = None,
    joints: str = "OBCs",
    sketch: dict[str, float] | None = None,
    **changes: float,
) -> md.Mechanism:
    """Return O-B-C with the slider on +x; ``joints`` names those with friction (s: the guide)."""
    values = {**S1, **(INERTIA if inertia else {}), **(masses or {}), **changes}
    rod: dict[str, Any] = {}
    if "m_rod" in values:
        rod = {"mass": "m_rod", "inertia": "I_rod", "center": ("c_rod", 0)}
    slider = {"mass": "m_slider"} if "m_slider" in values else {}

    def pin(name: str) -> dict[str, Any]:
        return {"friction": "f", "pin_radius": f"r_{name}"} if name in joints else {}

    guide: dict[str, Any] = {"friction": "f_slide"} if "s" in joints else {}
    if contact_length is not None:
        guide["contact_length"] = contact_length
    return md.Mechanism(
        parameters=values,
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "B": ("r", 0)}),
            md.Body("rod", {"B": (0, 0), "C": ("l", 0)}, **rod),
            md.Body("slider", {"C": (0, 0)}, **slider),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O", **pin("O")),
            md.Revolute("B", "crank.B", "rod.B", **pin("B")),
            md.Revolute("C", "rod.C", "slider.C", **pin("C")),
            md.Prismatic("slide", "ground.O", "slider.C", **guide),
        ],
        loads=[
            load or md.Resistance("work", "slide.slide", negative="Q_work", positive="Q_return")
        ],
        gravity=gravity,
        sketch=sketch or {"crank": 1.0, "rod": -0.3},
    )


def quick_return(block: bool) -> md.Mechanism:
    """Return crank O-A and rod G with a slot; the pin in it bare, or in a block of its own."""
    friction = {"friction": "f"}
    bodies = [
        md.Body("crank", {"O": (0, 0), "A": ("OA", 0)}),
        md.Body("rod", {"G": (0, 0)}),
    ]
    joints: list[md.Revolute | md.Prismatic | md.PinInSlot] = [
        md.Revolute("O", "ground.O", "crank.O", pin_radius="r_O", **friction)
    ]
    if block:
        bodies.append(md.Body("block", {"A": (0, 0)}))
        joints += [
            md.Revolute("A", "crank.A", "block.A", pin_radius="r_A", **friction),
            md.Prismatic("slot", "rod.G", "block.A", friction="f_slot"),
        ]
    else:
        joints.append(md.PinInSlot("slot", "rod.G", "crank.A", friction="f_slot", pin_radius="r_A"))
    joints.append(md.Revolute("G", "ground.G", "rod.G", pin_radius="r_G", **friction))
    return md.Mechanism(
        parameters={
            "OA": 0.08,
            "OG": 0.2,
            "r_O": 0.020,
            "r_A": 0.012,
            "r_G": 0.018,
            "f": 0.1,
            "f_slot": 0.15,
            "M_load": 30.0,
        },
        ground=md.Ground({"O": (0, 0), "G": (0, "-OG")}),
        bodies=bodies,
        joints=joints,
        loads=[md.Resistance("work", "rod.angle", negative="M_load", positive="M_load")],
        sketch={"crank": 0.5, "rod": 1.3},
    )


def scaled_four_bar(s: float, density: float, g: float = 9.81) -> md.Mechanism:
    """Return the four-bar of fourbar_scale.json: uniform links, lengths in units of ``s``."""

    def rod(name: str, p: str, q: str, length: float) -> md.Body:
        return md.Body(
            name,
            {p: (0, 0), q: (f"{length}*s", 0)},
            mass=f"density*{length}*s",
            center=(f"{length}*s/2", 0),
            inertia=f"density*({length}*s)**3/12",
        )

    return md.Mechanism(
        parameters={"s": s, "density": density},
        ground=md.Ground({"O": (0, 0), "D": ("3.2*s", 0)}),
        bodies=[
            rod("crank", "O", "A", 1),
            rod("coupler", "A", "B", 3),
            rod("rocker", "D", "B", 2.5),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "coupler.A"),
            md.Revolute("B", "coupler.B", "rocker.B"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        gravity=(0, -g),
        sketch={"crank": 1.0, "coupler": -1.2, "rocker": -2.24},
    )


def tipping_block(mu: float, pull: float = 0.1) -> md.Mechanism:
    """Return a block on two contacts, pulled at the height ``pull``, its mass at 0.2 over them.

    The driver acts at the centre of mass, where it does not tip: the normal forces are then
    those of the freely sliding block, and the effort is mass times the acceleration imposed
    less the one of free sliding.
    """
    contact = {"friction": mu, "pin_radius": 0}
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body(
                "block",
                {"rear": (-0.05, 0), "front": (0.05, 0), "M": (0, 0.2), "P": (0, pull)},
                mass=2.0,
                center=(0, 0.2),
                inertia=0.01,
            )
        ],
        joints=[
            md.PinInSlot("rear", "ground.O", "block.rear", **contact),
            md.PinInSlot("front", "ground.O", "block.front", **contact),
        ],
        loads=[md.Force("pull", "block.P", (10, 0))],
        sketch={"block": 0.0, "block.M.x": 0.3},
    )


def drawer(mu: float) -> md.Mechanism:
    """Return a drawer in a guide 0.3 m long, pulled 0.5 m beside it against 1 N."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("drawer", {"C": (0, 0), "H": (0, 0.5)})],
        joints=[md.Prismatic("guide", "ground.O", "drawer.C", friction=mu, contact_length=0.3)],
        loads=[md.Resistance("load", "guide.slide", negative=1, positive=1)],
        sketch={"drawer.H.x": 0.1},
    )


def two_slider_cranks(r: float = 0.09, l: float = 0.1) -> md.Mechanism:  # noqa: E741
    """Return two slider-cranks on one crank, to the right and to the left, each with its load."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "A": (r, 0), "B": (-r, 0)}),
            md.Body("rod", {"A": (0, 0), "C": (l, 0)}),
            md.Body("slider", {"C": (0, 0)}),
            md.Body("rod2", {"B": (0, 0), "D": (-l, 0)}),
            md.Body("slider2", {"D": (0, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "rod.A"),
            md.Revolute("C", "rod.C", "slider.C"),
            md.Prismatic("slide", "ground.O", "slider.C", friction=0.6),
            md.Revolute("B", "crank.B", "rod2.B"),
            md.Revolute("D", "rod2.D", "slider2.D"),
            md.Prismatic("slide2", "ground.O", "slider2.D", friction=0.7),
        ],
        loads=[
            md.Force("push", "slider.C", (-100, 0)),
            md.Force("push2", "slider2.D", (50, 0)),
        ],
        sketch={"crank": 1.5, "rod": -1.1, "rod2": -1.1},
    )


def cranks_and_beam(count: int = 6, friction: float | None = None) -> md.Mechanism:
    """Return parallel cranks under one beam, with redundant constraints: L = m = 1."""
    pin = {} if friction is None else {"friction": friction, "pin_radius": 0.01}
    cranks = [
        md.Body(f"crank{k}", {"O": (0, 0), "A": (1, 0)}, mass=1, center=(0.5, 0), inertia="1/12")
        for k in range(count)
    ]
    middle = (count - 1) / 2
    beam = md.Body(
        "beam",
        {f"A{k}": (k, 0) for k in range(count)},
        mass=count,
        center=(middle, 0),
        inertia=count * (count - 1) ** 2 / 12,
    )
    return md.Mechanism(
        ground=md.Ground({f"O{k}": (k, 0) for k in range(count)}),
        bodies=[*cranks, beam],
        joints=[
            *(
                md.Revolute(f"ground{k}", f"ground.O{k}", f"crank{k}.O", **pin)
                for k in range(count)
            ),
            *(md.Revolute(f"beam{k}", f"crank{k}.A", f"beam.A{k}", **pin) for k in range(count)),
        ],
        gravity=(0, -9.81),
        sketch={**{f"crank{k}": 1.0 for k in range(count)}, "beam": 0.0},
    )


def two_guides(friction: bool = True) -> md.Mechanism:
    """Return a body on two guides in one line that share a weight in a way nobody knows."""
    first, second = ({"friction": 0.1}, {"friction": 0.3}) if friction else ({}, {})
    return md.Mechanism(
        ground=md.Ground({"P": (0, 0), "Q": (1, 0)}),
        bodies=[md.Body("slide", {"A": (0, 0), "B": (1, 0)}, mass=10, center=(0.5, 0))],
        joints=[
            md.Prismatic("left", "ground.P", "slide.A", **first),
            md.Prismatic("right", "ground.Q", "slide.B", **second),
        ],
        gravity=(0, -10),
        sketch={"left": 0.2},
    )


def reactions(coordinate: str = "crank.angle", *, at: Any = None, **keys: Any) -> md.Reactions:
    """Return the task; ``speed``, ``acceleration``, ``from_``, ``to`` go to the driver."""
    names = ("speed", "acceleration", "from_", "to")
    driver = {name: keys.pop(name) for name in names if name in keys}
    if at is not None:
        driver["at"] = tuple(float(a) for a in at)
    return md.Reactions(md.Driver(coordinate, **driver), **keys)
