"""Every kind of design of the benchmark cases, judged by closures that share no code with it.

``verdict(name, task, design)`` gives the objective in the unit of the bar and the defects; a
design whose report differs from what the closure says has one too. Judge those that declare none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.reference.closure_fourbar import (
    TURN,
    FourBar,
    GearedFiveBar,
    StephensonThree,
    WattTwo,
    function_error,
    judged,
    lowest,
)
from tests.shared.synthesis_cases import cases, four_bar, verdict_of

AGREES = 1e-5
"""Share by which a reported objective may differ from that of the closure."""
LINE = 1e-2
"""The same of straight lines: the package measures from its own line, not from the best one."""
NODES = 2881


@dataclass(frozen=True)
class Judged:
    """Objective in the unit of the bar, and what is wrong."""

    value: float
    defects: tuple


def verdict(name, task, design):
    """Judge a design of a case."""
    case = cases()[name]
    kind = case["kind"]
    if kind.startswith("crank-rocker"):
        value, reported, defects = rocker(case, task, design)
    elif kind.startswith("straight"):
        value, reported, defects = straight(case, design)
    elif kind.startswith("function"):
        value, reported, defects = function(case, design)
    elif kind.startswith("path geared"):
        value, reported, defects = geared(case, design)
    else:
        value, reported, defects = path(case, design)
    defects = [*defects, *outside(name, task, design)]
    share = LINE if kind.startswith("straight") else AGREES
    if not abs(value - reported) <= share * abs(value) + floor(case):
        defects.append(f"reported {reported:.9g}, the closure says {value:.9g}")
    return Judged(float(value), tuple(defects))


def floor(case):
    """What rounding leaves of an objective, in the unit of the bar."""
    if "targets" in case:
        targets = np.array(case["targets"])
        return 1e-15 * float(np.sum((targets - targets.mean(axis=0)) ** 2)) + 1e-9 * (
            "mu_min_deg" in case.get("bar", {})
        )
    return 1e-8


def outside(name, task, design):
    """Name the parameters beyond the bounds of the problem file."""
    import mechdae as md

    free = md.load(name).tasks[task].free
    found = []
    for key, bounds in free.items():
        value = design["parameters"][key]
        if isinstance(bounds, (list, tuple)):
            low, high = bounds
            if not low - 1e-9 * (high - low) <= value <= high + 1e-9 * (high - low):
                found.append(f"{key} = {value:.9g} is beyond its bounds")
    return found


# -- kinds -----------------------------------------------------------------------------------------


def path(case, design):
    found, f = verdict_of(case, design)
    defects = list(found.defects)
    if "mu_min_deg" not in case.get("bar", {}):
        return f, design["objective"], defects
    if found.errors.max() > case["bar"]["point_error_max"]:
        defects.append(f"a point is missed by {found.errors.max():.3g}")
    return np.degrees(found.transmission), np.degrees(design["objective"]), defects


def geared(case, design):
    p = design["parameters"]
    linkage = GearedFiveBar(
        tuple(p[n] for n in ("r1", "r2", "r3", "r4", "r5")), p["i"], p["phi"],
        complex(p["r_cx"], p["r_cy"]), p["x0"], p["y0"], p["theta0"],
    )  # fmt: skip
    found = judged(linkage, design["at"], np.array(case["targets"]), ordered=False)
    return found.f, design["objective"], list(found.defects)


def function(case, design):
    p = design["parameters"]
    if case["kind"] == "function four-bar":
        linkage = FourBar((1.0, p["a"], p["b"], p["c"]))
    elif case["kind"].endswith("Watt II"):
        names = ("a", "b", "c", "phi0", "psi0", "s0", "e", "f", "delta", "gx", "gy")
        linkage = WattTwo.of([p[n] for n in names])
    else:
        names = ("a", "b", "c", "phi0", "psi0", "e", "f", "u", "v", "gx", "gy")
        linkage = StephensonThree.of([p[n] for n in names])
    x = np.linspace(*case["x_range"], 721)
    functions = {
        "log10(x)": np.log10, "sin(x deg)": lambda x: np.sin(np.radians(x)), "x^2": np.square,
        "exp(x)": np.exp,
    }  # fmt: skip
    y = functions[case["function"]](x)
    share_in, share_out = ((v - v[0]) / (v[-1] - v[0]) for v in (x, y))
    ranges = np.radians([case["delta_phi_deg"], case["delta_psi_deg"]])
    tried = [
        function_error(linkage, p["phi0"], p["psi0"], sense, share_in, share_out, ranges)
        for sense in (1, -1)
    ]
    error, found = min(tried, key=lambda pair: pair[0])
    least = 0.05 if case["kind"] == "function four-bar" else 0.1
    defects = list(found.defects)
    if np.sqrt(max(found.height, 0.0)) < least * 0.99:
        defects.append(f"sine of the transmission angle {np.sqrt(max(found.height, 0)):.4g}")
    return np.degrees(error), np.degrees(design["objective"]), defects


def straight(case, design):
    p = design["parameters"]
    linkage = four_bar(p)
    theta = np.linspace(design["at"][0], design["at"][-1], NODES)
    defects = []
    best = np.inf
    for sign in (1, -1):
        if lowest(linkage, (sign,), 0.0, TURN) <= 0:
            defects.append("full turn")
            break
        values, heights = linkage.moved(theta, (sign,))
        z = values["point"]
        z = (z - z[0]) * np.exp(-1j * np.angle(z[-1] - z[0]))
        span = least_span(z)
        if span < best:
            best, stroke = span, z.real
            weak = float(np.sqrt(heights[0].min()))
    if not defects:
        if abs(abs(np.ptp(theta)) - np.pi) > 1e-9 or abs(np.ptp(stroke) - 1) > 1e-6:
            defects.append(f"arc {np.degrees(np.ptp(theta)):.6g} deg, stroke {np.ptp(stroke):.9g}")
        if (np.diff(stroke) < 0).any():
            defects.append("the point turns back")
        if weak < 0.34 * (1 - 1e-3):
            defects.append(f"sine of the transmission angle {weak:.4g}")
    return best, design["objective"], defects


def least_span(z):
    """Return half the least width of a strip that holds places along the real axis."""
    a, b = -1e-2, 1e-2
    for _ in range(100):
        c, d = a + (b - a) / 3, b - (b - a) / 3
        spans = [np.ptp((z * np.exp(1j * t)).imag) for t in (c, d)]
        a, b = (a, d) if spans[0] < spans[1] else (c, b)
    return float(np.ptp((z * np.exp(1j * a)).imag)) / 2


def rocker(case, task, design):
    p = design["parameters"]
    r2, r3, r4 = p["r2"], p["r3"], p["r4"]
    linkage = FourBar((1.0, r2, r3, r4))
    defects = []
    if linkage.grashof != "crank-rocker":
        defects.append(f"it is a {linkage.grashof}")
    # the ends of the swing by the cosine rule: crank and coupler in line
    swing = np.subtract(*[np.arccos((1 + r4**2 - (r3 + s * r2) ** 2) / (2 * r4)) for s in (1, -1)])
    ends = [np.arccos((1 + (r3 + s * r2) ** 2 - r4**2) / (2 * (r3 + s * r2))) for s in (1, -1)]
    stroke = np.pi + abs(ends[0] - ends[1])
    if abs(np.degrees(swing) - case["rocker_swing_deg"]) > 1e-7:
        defects.append(f"it swings by {np.degrees(swing):.9g} deg")
    if abs(stroke / (TURN - stroke) - case["time_ratio"]) > 1e-8:
        defects.append(f"its time ratio is {stroke / (TURN - stroke):.9g}")
    cosines = [(r3**2 + r4**2 - r**2) / (2 * r3 * r4) for r in (1 - r2, 1 + r2)]
    if task == "design":
        mu = np.degrees(np.arccos(np.abs(cosines).max()))
        return mu, np.degrees(design["objective"]), defects
    # the mean power at one radian a second, by f r_pin times the work of a cycle
    reported = design["objective"] * TURN / (0.1 * 0.01 * 2 * swing)
    exact = loss_index(r2, r3, r4, swing, 200_000, 0.0)
    if abs(reported - exact) > AGREES * exact:
        defects.append(f"loss {reported:.9g}, the closure says {exact:.9g}")
    own = loss_index(r2, r3, r4, swing)
    return own, own, defects


def loss_index(r2, r3, r4, swing, nodes=72, smooth=1e-8):
    """Loss of equal pins under a constant output torque, r1 = 1, as the case defines it."""
    theta = TURN * np.arange(nodes) / nodes
    A = r2 * np.exp(1j * theta)
    gap = 1 - A
    size = np.abs(gap)
    opened = np.arccos((size**2 + r3**2 - r4**2) / (2 * size * r3))
    t3 = np.angle(gap) + opened
    t4 = np.angle(A + r3 * np.exp(1j * t3) - 1)
    w3 = r2 * np.sin(t4 - theta) / (r3 * np.sin(t3 - t4))
    w4 = r2 * np.sin(t3 - theta) / (r4 * np.sin(t3 - t4))

    def size_of(z):
        return np.sqrt(z**2 + smooth)

    sliding = 1 + size_of(1 - w3) + size_of(w4 - w3) + size_of(w4)
    whole = sliding / (r4 * np.abs(np.sin(t3 - t4)))
    return float(np.sum(whole) * TURN / nodes / (2 * swing))
