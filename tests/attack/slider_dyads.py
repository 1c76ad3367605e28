"""Limits of transmission angles of dyads with slides in synthesis, against closed forms.

    python -m tests.attack.slider_dyads --count 300 --out docs/data/slider-dyads.json

Each case draws a mechanism whose transmission angle falls too low, makes its motion the target
of a function goal, and asks for a least angle above: the best design lies on the limit. What is
reported is judged by formulas that share nothing with the package, at 20 001 angles of the
crank, or at the poses of the goal where the limit is one of those. The exit code is 1 where a
design breaks its limit.
"""

from __future__ import annotations

import functools
import math
import sys
from collections import Counter

import numpy as np

from tests.shared import attack

ANGLES = 20_001
SLACK = 1e-7
TURN = 2 * np.pi
FAMILIES = ("slider-crank", "inverted", "pin in a slot", "turning guide", "second dyad", "yoke")


# -- closed forms: sine of the transmission angle and the output over the angles of the crank ----


def slider_crank(v, t):
    """Rod l from the crank's pin to a guide along x at height e."""
    height = np.sin(t) - v["e"]
    return np.sqrt(1 - (height / v["l"]) ** 2), np.cos(t) + np.sqrt(v["l"] ** 2 - height**2)


def inverted(v, t):
    """Lever about (g, 0) whose slot passes its pivot at the distance c; the crank's pin in it."""
    arm = np.exp(1j * t) - v["g"]
    far = np.abs(arm)
    return np.sqrt(1 - (v["c"] / far) ** 2), np.unwrap(np.angle(arm)) - np.arcsin(v["c"] / far)


def turning_guide(v, t):
    """Guide on the crank at the distance a of its pivot; a block in it carries a rocker of l."""
    height = v["a"] + v["g"] * np.sin(t)
    along = np.sqrt(v["l"] ** 2 - height**2)
    pin = v["g"] + (along + 1j * height) * np.exp(1j * t)
    return along / v["l"], np.unwrap(np.angle(pin - v["g"]))


def second_dyad(v, t, side=1):
    """Crank 1, coupler 3, rocker 2.5, ground 3; its pin drives a rod l to a guide x at height e.

    `side` is the mode of the first dyad. Both modes of any other dyad here have the same angle.
    """
    A = np.exp(1j * t)
    line = 3 - A
    far = np.abs(line)
    along = (far**2 + 9 - 6.25) / (2 * far)
    B = A + (along + 1j * side * np.sqrt(9 - along**2)) * line / far
    height = B.imag - v["e"]
    return np.sqrt(1 - (height / v["l"]) ** 2), B.real + np.sqrt(v["l"] ** 2 - height**2)


def yoke(v, t):
    """Yoke on a guide along x, its slot at the angle b: two slides, a constant angle."""
    place = np.cos(t) - np.sin(t) * math.cos(v["b"]) / math.sin(v["b"])
    return np.full_like(t, math.sin(v["b"])), place


FORMS = dict(
    zip(FAMILIES, (slider_crank, inverted, inverted, turning_guide, second_dyad, yoke), strict=True)
)

FIRST_DYAD = math.acos((9 + 6.25 - (3 - 1) ** 2) / (2 * 3 * 2.5))
"""Least transmission angle of the four-bar of the second dyad: crank and ground in line."""


def form_of(family, pose):
    """Return the closed form on the mode of a design's sketch."""
    if family != "second dyad":
        return FORMS[family]
    side = math.copysign(1, math.sin(pose["rocker"] - pose["coupler"]))
    return functools.partial(second_dyad, side=side)


# -- files ----------------------------------------------------------------------------------------

HEAD = """schema = 1
[ground]
points = { O = [0, 0], G = %s }
[bodies.crank]
points = { O = [0, 0], A = [1, 0], H = %s }
"""
BODIES = {
    "slider-crank": """
[bodies.rod]
points = { A = [0, 0], B = ["l", 0] }
[bodies.slider]
points = { B = [0, 0] }
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"] }
A = { kind = "revolute", between = ["crank.A", "rod.A"] }
B = { kind = "revolute", between = ["rod.B", "slider.B"] }
out = { kind = "prismatic", between = ["ground.G", "slider.B"] }
""",
    "inverted": """
[bodies.block]
points = { A = [0, 0] }
[bodies.lever]
points = { G = [0, 0], S = [0, "c"] }
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"] }
A = { kind = "revolute", between = ["crank.A", "block.A"] }
slot = { kind = "prismatic", between = ["lever.S", "block.A"] }
out = { kind = "revolute", between = ["ground.G", "lever.G"] }
""",
    "pin in a slot": """
[bodies.lever]
points = { G = [0, 0], S = [0, "c"] }
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"] }
slot = { kind = "pin-in-slot", between = ["lever.S", "crank.A"] }
out = { kind = "revolute", between = ["ground.G", "lever.G"] }
""",
    "turning guide": """
[bodies.block]
points = { B = [0, 0] }
[bodies.rocker]
points = { G = [0, 0], B = ["l", 0] }
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"] }
slot = { kind = "prismatic", between = ["crank.H", "block.B"] }
B = { kind = "revolute", between = ["block.B", "rocker.B"] }
out = { kind = "revolute", between = ["ground.G", "rocker.G"] }
""",
    "second dyad": """
[bodies.coupler]
points = { A = [0, 0], C = [3, 0] }
[bodies.rocker]
points = { D = [0, 0], C = [2.5, 0] }
[bodies.rod]
points = { C = [0, 0], B = ["l", 0] }
[bodies.slider]
points = { B = [0, 0] }
[bodies.base]
points = { O = [0, 0], D = [3, 0] }
[joints]
floor = { kind = "weld", between = ["ground.O", "base.O"] }
O = { kind = "revolute", between = ["ground.O", "crank.O"] }
A = { kind = "revolute", between = ["crank.A", "coupler.A"] }
C = { kind = "revolute", between = ["coupler.C", "rocker.C"] }
D = { kind = "revolute", between = ["base.D", "rocker.D"] }
C2 = { kind = "revolute", between = ["rocker.C", "rod.C"] }
B = { kind = "revolute", between = ["rod.B", "slider.B"] }
out = { kind = "prismatic", between = ["ground.G", "slider.B"] }
""",
    "yoke": """
[bodies.block]
points = { A = [0, 0] }
[bodies.yoke]
points = { G = [0, 0] }
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"] }
A = { kind = "revolute", between = ["crank.A", "block.A"] }
slot = { kind = "prismatic", between = ["yoke.G", "block.A"], axis = "b", turn = 0 }
out = { kind = "prismatic", between = ["ground.G", "yoke.G"] }
""",
}
PAIRS = {
    "slider-crank": ("rod", "slider"), "inverted": ("lever", "block"),
    "pin in a slot": ("crank", "lever"), "turning guide": ("block", "rocker"),
    "second dyad": ("rod", "slider"), "yoke": ("yoke", "block"),
}  # fmt: skip
BOUNDS = {
    "slider-crank": {"l": (1.01, 12), "e": (-2, 2)},
    "inverted": {"g": (1.3, 6), "c": (-2, 2)},
    "pin in a slot": {"g": (1.3, 6), "c": (-2, 2)},
    "turning guide": {"l": (0.5, 12), "a": (-1, 1), "g": (0.3, 0.8)},
    "second dyad": {"l": (0.5, 20), "e": (-1, 3)},
    "yoke": {"b": (0.2, 1.5)},
}


def drawn(family, generator):
    """Return dimensions whose least transmission angle is between 12 and 45 degrees."""
    mu = generator.uniform(np.radians(12), np.radians(45))
    cos = math.cos(mu)
    if family == "slider-crank":
        e = generator.uniform(-0.8, 0.8)
        return {"l": (1 + abs(e)) / cos, "e": e}, mu
    if family in ("inverted", "pin in a slot"):
        g = generator.uniform(1.5, 3.5)
        return {"g": g, "c": (g - 1) * cos * generator.choice((-1, 1))}, mu
    if family == "turning guide":
        a, g = generator.uniform(-0.3, 0.3), generator.uniform(0.4, 0.7)
        return {"l": (abs(a) + g) / cos, "a": a, "g": g}, mu
    if family == "second dyad":
        e = generator.uniform(0.5, 2.0)
        heights = second_dyad({"l": 1e3, "e": e}, np.linspace(0, TURN, ANGLES))[0]
        far = float(np.sqrt(1 - heights.min() ** 2) * 1e3)
        return {"l": far / cos, "e": e}, mu
    return {"b": mu}, mu


def case(seed):
    """Return family, text of the file, limit, word of where it holds, angles of the targets."""
    generator = np.random.default_rng([seed, 77])
    family = FAMILIES[seed % len(FAMILIES)]
    bad, mu = drawn(family, generator)
    limit = mu + generator.uniform(np.radians(5), np.radians(20))
    over = "goal" if generator.random() < 0.3 else "turn"
    at = np.sort(generator.uniform(0, TURN, 11))
    at -= at[0]
    output = FORMS[family](bad, at)[1]
    slides = family in ("slider-crank", "second dyad", "yoke")
    own = f'between = {list(PAIRS[family])}, min = {float(limit)!r}, over = "{over}"'
    word = "slide" if slides else "angle"
    ground = {"slider-crank": '[0, "e"]', "second dyad": '[0, "e"]', "yoke": "[0, 0]"}
    text = HEAD % (
        ground.get(family, '["g", 0]'), '[0, "a"]' if family == "turning guide" else "[0, 0]"
    )  # fmt: skip
    text += BODIES[family] + "[parameters]\n"
    text += "".join(f"{name} = {float(value)!r}\n" for name, value in bad.items())
    text += "[sketch]\ncrank = 0\n" + sketch(family, bad)
    targets = [[float(a), float(b)] for a, b in zip(at, output, strict=True)]
    bounds = {name: list(ends) for name, ends in BOUNDS[family].items()}
    text += f"""
[tasks.design]
kind = "synthesis"
driver = {{ coordinate = "O.angle" }}
starts = 6
seed = {seed}
goal = {{ kind = "function", input = "O.angle", output = "out.{word}", targets = {targets} }}
constraints = [
  {{ kind = "full-turn", coordinate = "O.angle" }},
  {{ kind = "transmission-angle", {own} }},
]
[tasks.design.free]
""".replace("'", '"')
    text += "".join(f"{name} = {ends}\n" for name, ends in bounds.items())
    return family, text, limit, over, at


def sketch(family, v):
    """Return the pose at a crank angle of zero, from the closed form."""
    zero = np.zeros(1)
    if family == "slider-crank":
        return f"rod = {float(math.asin(v['e'] / v['l']))!r}\n"
    if family in ("inverted", "pin in a slot"):
        return f"lever = {float(inverted(v, zero)[1][0])!r}\n"
    if family == "turning guide":
        return f"rocker = {float(turning_guide(v, zero)[1][0])!r}\n"
    if family == "second dyad":
        along = (4 + 9 - 6.25) / 4
        C = 1 + along + 1j * math.sqrt(9 - along**2)
        rod = math.asin((v["e"] - C.imag) / v["l"])
        return (
            f"coupler = {float(np.angle(C - 1))!r}\nrocker = {float(np.angle(C - 3))!r}\n"
            f"rod = {rod!r}\n"
        )
    return ""


def judged(seed):
    """Return what a case gave, with its faults."""
    import tomllib

    import mechdae as md
    from mechdae.describe.file.load import from_dict

    family, text, limit, over, at = case(seed)
    problem = from_dict(tomllib.loads(text))
    result = md.synthesize(problem)
    designs = result.data["designs"]
    faults, margins = [], []
    for design in designs:
        v = design["parameters"]
        t = at if over == "goal" else np.linspace(0, TURN, ANGLES)
        form = form_of(family, tomllib.loads(design["problem"])["sketch"])
        with np.errstate(invalid="ignore"):
            least = float(np.arcsin(form(v, t)[0].min()))
            whole = float(np.arcsin(form(v, np.linspace(0, TURN, ANGLES))[0].min()))
        margins.append(least - limit)
        if not least >= limit - SLACK:
            faults.append(f"{math.degrees(least):.6f} deg, the limit is {math.degrees(limit):.6f}")
        told = design["transmission_angle_min"]
        if family == "second dyad":
            whole = min(whole, FIRST_DYAD)
        if not abs(told - whole) <= 1e-6:
            faults.append(f"told {told:.9g}, in truth {whole:.9g}")
    if not designs:
        faults.append(f"no design: {result.fault}")
    row = {"seed": seed, "family": family, "over": over, "designs": len(designs)}
    return row | {"margin": min(margins, key=abs) if margins else None, "faults": faults}


def main(arguments=None):
    options = attack.parser(__doc__, 300).parse_args(arguments)
    rows = []
    for seed in range(options.seed, options.seed + options.count):
        rows.append(judged(seed))
        if rows[-1]["faults"]:
            print(rows[-1], file=sys.stderr, flush=True)
    margins = np.array([row["margin"] for row in rows if row["margin"] is not None])
    figures = {
        "cases": len(rows),
        "families": dict(Counter(row["family"] for row in rows)),
        "angles": ANGLES,
        "designs": sum(row["designs"] for row in rows),
        "on the limit": int(np.sum(np.abs(margins) < 1e-6)),
        "furthest below [rad]": float(max(0.0, -margins.min())),
        "faults": [row for row in rows if row["faults"]],
    }
    return attack.ended(figures, options.out, figures["faults"])


if __name__ == "__main__":
    sys.exit(main())
