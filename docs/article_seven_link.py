"""Article 000 on the page of articles: kinematics of a seven-link mechanism, number by number."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from article_text import (
    below,
    cosd,
    fixed,
    percent,
    places,
    sign,
    sind,
    table,
    text,
    unit,
    unit_of,
    verdict,
)

import mechdae as md
from mechdae.draw.diagram.scene import read_scene
from mechdae.draw.plans.relations import motion_plan

SEVEN = "gorshkov-seven-link"


@dataclass(frozen=True)
class Row:
    """One printed number: name, place in the article, key of ours, value, drawing, reason."""

    name: str
    key: str
    printed: str
    drawn: str = ""
    why: str = ""


SLIP = "F is given at 0.8727 and used at 0.8725"
FROM_EB = "follows from the wrong v_EB"
FROM_E = "follows from the wrong v_E"
FROM_BOTH = "follows from the wrong v_EB and v_E"

PRINTED: dict[str, list[Row]] = {
    "positions of the joints, Fig. 3": [
        Row("x_A", "xA", "0.135"),
        Row("y_A", "yA", "0.106"),
        Row("φ2, deg", "phi2", "13.237", why="slip of the pen: the article goes on with 13.239"),
        Row("φ2, deg, later on", "phi2", "13.239"),
        Row("φ2, deg, in the angle of a_A3t", "phi2", "13.329", why="two digits exchanged: 13.239"),
        Row("φ3, deg", "phi3", "38.664", why="two digits exchanged: 38.644"),
        Row("x_B", "xB", "0.191"),
        Row("y_B", "yB", "0.344"),
        Row("OB", "OB", "0.394"),
        Row("φ4, deg", "phi4", "60.962"),
        Row("φ5, deg", "phi5", "41.64"),
        Row("φ6, deg", "phi6", "77.398"),
        Row("x_C", "xC", "0.578"),
    ],
    "coordinates of E": [
        Row("P1", "P1", "0.137"),
        Row("P1 inside q", "P1", "0.173", why="two digits exchanged: 0.137"),
        Row("P2", "P2", "-0.67"),
        Row("a1", "a1", "-1.173"),
        Row("a1 inside q", "a1", "-1.73", why="a digit dropped: −1.173"),
        Row("b1", "b1", "-1.98"),
        Row("p_k", "pk", "-0.649"),
        Row("q", "qk", "0.416"),
        Row("E_x", "xE", "0.725"),
        Row("E_y", "yE", "0.263"),
        Row("δ, deg", "delta", "60.66", why=SLIP),
        Row("γ, deg", "gamma", "8.677", why=SLIP),
    ],
    "group 2-3, velocities": [
        Row("v_A", "vA", "0.6864"),
        Row("v_A, in the projections", "vA", "0.686"),
        Row("v_Ax", "vAx", "0.424"),
        Row("v_Ay", "vAy", "-0.54"),
        Row("cos φ2", "cos2", "0.973"),
        Row("sin φ2", "sin2", "0.229"),
        Row("v_A3", "vA3", "0.536"),
        Row("v_A1A3", "vSlide", "0.429"),
        Row("ω3", "w3", "0.909"),
    ],
    "group 2-3, accelerations": [
        Row("a_A", "aA", "2.7456"),
        Row("a_A, in the projections", "aA", "2.746"),
        Row("a_A3 Coriolis", "aCor", "0.780"),
        Row("its angle, deg", "angCor", "346.761"),
        Row("its x", "aCorx", "0.759"),
        Row("its y", "aCory", "-0.179"),
        Row("a_A3n", "aA3n", "0.487"),
        Row("GA inside a_A3n", "s", "0.5859", why="two digits exchanged: 0.5895"),
        Row("angle of the rod, deg", "th3", "76.761"),
        Row("a_A3n x, as in the sum", "aA3nx", "0.112"),
        Row("a_A3n y, as in the sum", "aA3ny", "0.474"),
        Row("angle of a_A, deg", "angA", "218.117"),
        Row("a_A x", "aAx", "-2.16"),
        Row("a_A y", "aAy", "-1.695"),
        Row("sum x", "PrX23", "-1.289"),
        Row("sum y", "PrY23", "-1.399"),
        Row("a_A3t", "aA3t", "0.934"),
        Row("a_A3t, at the solution", "aA3t", "9.934", why="a 9 for the leading 0"),
        Row("a_32 relative", "a32r", "1.657"),
        Row("ε3", "e3", "1.584"),
        Row("a_A3", "aA3", "1.054"),
        Row(
            "angle of a_A3, deg",
            "angA3",
            "194.316",
            why="arccos of a quotient of rounded numbers",
        ),
    ],
    "group 4-5, velocities": [
        Row("v_B", "vB", "0.758"),
        Row("v_Bx", "vBx", "0.738"),
        Row("v_By", "vBy", "-0.174"),
        Row("v_C", "vC", "0.893"),
        Row("v_CB", "vCB", "0.232"),
        Row("ω4", "w4", "0.448"),
    ],
    "group 4-5, accelerations": [
        Row("a_B; drawn in Fig. 7", "aB", "1.491", "1.55"),
        Row("a_B x", "aBx", "-1.445"),
        Row("a_B y, Table 1", "aBy", "-0.349", why="arithmetic error; Table 2 has −0.369"),
        Row("a_B y, Table 2", "aBy", "-0.369"),
        Row("a_CBn", "aCBn", "0.104"),
        Row("its angle, deg", "angCBn", "138.36"),
        Row("a_CBn x", "aCBnx", "-0.078"),
        Row("a_CBn x, in the sum", "aCBnx", "-0.079", why="last digit; its table has −0.078"),
        Row("a_CBn y", "aCBny", "0.069"),
        Row("angle of a_CBt, deg", "angCBt", "48.36"),
        Row("sum x", "PrX45", "-1.522"),
        Row("sum y", "PrY45", "-0.28", why="follows from a_By = −0.349"),
        Row("a_CBt", "aCBt", "1.096", why="arithmetic error: breaks the article's own equation"),
        Row("a_C", "aC", "1.256"),
        Row("a_CB", "aCB", "1.01", why="follows from a_CBt, with a second slip"),
    ],
    "group 6-7, velocities": [
        Row("v_EB", "vEB", "0.621", "0.63", "arithmetic error: breaks the article's own equations"),
        Row("v_E", "vE", "0.932", "0.95", "arithmetic error: breaks the article's own equations"),
        Row("ω6", "w6", "1.15", "1.17", FROM_EB),
        Row("ω7", "w7", "3.093", "3.17", FROM_E),
    ],
    "group 6-7, accelerations": [
        Row("a_EFn", "aEFn", "2.883", "3.02", FROM_E),
        Row("its angle, deg", "angEFn", "119.34", why=SLIP),
        Row("a_EFn x, as in the sum", "aEFnx", "-1.413", why=FROM_E),
        Row("a_EFn y, as in the sum", "aEFny", "2.513", why=FROM_E),
        Row("angle of a_EFt, deg", "angEFt", "29.34", why=SLIP),
        Row("a_EBn", "aEBn", "0.714", "0.74", FROM_EB),
        Row("its angle, deg", "angEBn", "171.323", why=SLIP),
        Row("a_EBn x", "aEBnx", "-0.706", why=FROM_EB),
        Row("a_EBn y", "aEBny", "0.108", why=FROM_EB),
        Row("angle of a_EBt, deg", "angEBt", "261.323", why=SLIP),
        Row("sum x", "PrX67", "-3.563", why=FROM_BOTH),
        Row("sum y", "PrY67", "2.252", why=FROM_BOTH),
        Row("a_EBt", "aEBt", "4.708", "4.65", FROM_BOTH),
        Row("a_EFt", "aEFt", "4.924", "4.95", FROM_BOTH + ", and its own sums give 4.90"),
        Row("a_E", "aE", "5.706", "5.80", FROM_BOTH),
    ],
}

GIVEN = {"OA": 0.1716, "GA": 0.5895, "GB": 0.8342, "BC": 0.5179, "BE": 0.54, "EF": 0.3013}
GIVEN |= {"OF": 0.8727, "phi1": 38.117, "omega1": 4.0}
USED_OF = 0.8725
"""The abscissa of F in the formulas for E; the list of data has 0.8727."""


def quantities(result: Any) -> dict[str, float]:
    """Return the article's quantities at the first pose of a result, magnitudes as there."""
    p = result.mechanism.values()
    point = {
        name: tuple(np.array(series[k][0]) for k in ("position", "velocity", "acceleration"))
        for name, series in result.points.items()
    }
    body = {
        name: tuple(
            float(series[k][0]) for k in ("angle", "angular_velocity", "angular_acceleration")
        )
        for name, series in result.bodies.items()
    }
    slot = result.joints["slot"]
    (A, vA, aA), (B, vB, aB) = point["crank.A"], point["rod.B"]
    (C, vC, aC), (E, vE, aE) = point["slider.C"], point["coupler.E"]
    phi1 = np.degrees(body["crank"][0])
    th3 = np.degrees(body["rod"][0])
    (w3, e3), (w4, e4) = body["rod"][1:], body["connecting_rod"][1:]
    (w6, e6), (w7, e7) = body["coupler"][1:], body["rocker"][1:]
    s = float(slot.slide[0])
    phi2 = 90 - th3
    phi5 = np.degrees(np.arcsin(B[1] / p["BC"]))
    phi4 = np.degrees(np.arccos(B[0] / np.hypot(*B)))
    delta = np.degrees(np.arcsin(E[1] / p["EF"]))
    gamma = np.degrees(np.arcsin((B[1] - E[1]) / p["BE"]))
    P1 = p["BE"] ** 2 - B @ B
    P2 = p["EF"] ** 2 - p["OF"] ** 2
    a1, b1 = (P1 - P2) / (2 * (0 - B[1])), (p["OF"] - B[0]) / (0 - B[1])
    cor = -np.array(slot.coriolis[0])  # the article has A3 move relative to A1
    aA3n, aA3t = w3**2 * s, abs(e3) * s
    n23, nCB = aA3n * unit(th3), w4**2 * p["BC"] * unit(180 - phi5)
    nEF = w7**2 * p["EF"] * unit(180 - delta)
    nEB = w6**2 * p["BE"] * unit(180 - gamma)
    sum23, sum45, sum67 = aA + n23 + cor, aB + nCB, aB + nEF + nEB
    aCBn, aCBt = np.hypot(*nCB), abs(e4) * p["BC"]
    values = {
        "xA": A[0], "yA": A[1], "xB": B[0], "yB": B[1], "xC": C[0], "xE": E[0], "yE": E[1],
        "phi2": phi2, "phi3": th3 - phi1, "phi4": phi4, "phi5": phi5, "phi6": 180 - phi4 - phi5,
        "OB": np.hypot(*B), "P1": P1, "P2": P2, "a1": a1, "b1": b1,
        "pk": (b1 * B[1] - B[0] - a1 * b1) / (1 + b1**2),
        "qk": (a1**2 - 2 * a1 * B[1] - P1) / (1 + b1**2), "delta": delta, "gamma": gamma,
        "vA": np.hypot(*vA), "vAx": vA[0], "vAy": vA[1], "cos2": cosd(phi2), "sin2": sind(phi2),
        "vA3": abs(w3) * s, "vSlide": abs(float(slot.slide_velocity[0])), "w3": abs(w3), "s": s,
        "aA": np.hypot(*aA), "aCor": np.hypot(*cor), "aCorx": cor[0], "aCory": cor[1],
        "angCor": 360 - phi2, "th3": th3, "aA3n": aA3n, "aA3nx": n23[0], "aA3ny": n23[1],
        "angA": phi1 + 180, "aAx": aA[0], "aAy": aA[1], "PrX23": sum23[0], "PrY23": sum23[1],
        "aA3t": aA3t, "a32r": abs(float(slot.slide_acceleration[0])), "e3": abs(e3),
        "aA3": np.hypot(aA3n, aA3t), "angA3": np.degrees(np.arctan2(aB[1], aB[0])) % 360,
        "vB": np.hypot(*vB), "vBx": vB[0], "vBy": vB[1], "vC": abs(vC[0]),
        "vCB": abs(w4) * p["BC"], "w4": abs(w4), "aB": np.hypot(*aB), "aBx": aB[0], "aBy": aB[1],
        "aCBn": aCBn, "aCBnx": nCB[0], "aCBny": nCB[1], "angCBn": 180 - phi5,
        "angCBt": 90 - phi5, "PrX45": sum45[0], "PrY45": sum45[1], "aCBt": aCBt,
        "aC": abs(aC[0]), "aCB": np.hypot(aCBn, aCBt), "vEB": abs(w6) * p["BE"],
        "vE": np.hypot(*vE), "w6": abs(w6), "w7": abs(w7), "aEFn": np.hypot(*nEF),
        "aEFnx": nEF[0], "aEFny": nEF[1], "angEFn": 180 - delta, "angEFt": 90 - delta,
        "aEBn": np.hypot(*nEB), "aEBnx": nEB[0], "aEBny": nEB[1], "angEBn": 180 - gamma,
        "angEBt": 270 - gamma, "PrX67": sum67[0], "PrY67": sum67[1], "aEBt": abs(e6) * p["BE"],
        "aEFt": abs(e7) * p["EF"], "aE": np.hypot(*aE),
    }  # fmt: skip
    return {key: float(value) for key, value in values.items()}


@cache
def seven() -> Any:
    return md.load(SEVEN)


@cache
def pose(**changes: float) -> Any:
    """Return the article's pose, with parameters changed."""
    return md.solve(seven(), "pose", set=changes or None)


def printed_value(key: str, last: bool = False) -> float:
    """Return what the article prints for a quantity, its first or last print."""
    found = [row for rows in PRINTED.values() for row in rows if row.key == key]
    return float(found[-1 if last else 0].printed)


# -- article 000: the page ---------------------------------------------------------------------


def every_number() -> list[str]:
    """Return the table of all printed numbers."""
    ours = quantities(pose())
    lines = []
    counts = {"exact to print": 0, "rounding": 0, "**deviates**": 0}
    for place, rows in PRINTED.items():
        body = []
        for row in rows:
            true = ours[row.key]
            judged = verdict(row.printed, true)
            counts[judged] += 1
            if (judged == "**deviates**") != bool(row.why):
                raise ArithmeticError(f"{row.name}: {judged}, reason '{row.why}'")
            body.append(
                [
                    row.name,
                    sign(row.printed),
                    row.drawn,
                    text(true),
                    percent(float(row.printed), true),
                    percent(float(row.drawn), true) if row.drawn else "",
                    f"{judged}: {row.why}" if row.why else judged,
                ]
            )
        lines += [f"**{place[0].upper()}{place[1:]}**", ""]
        head = "quantity | printed | drawn | mechdae | printed, % | drawn, % | verdict"
        lines += table(head, body)
    summary = (
        f"{sum(counts.values())} numbers: {counts['exact to print']} exact to print, "
        f"{counts['rounding']} within rounding, {counts['**deviates**']} deviate."
    )
    return [*lines, summary, ""]


def solve2(first: Any, second: Any, right: Any) -> tuple[float, float]:
    """Return the factors of two vectors whose sum is a third one."""
    x, y = np.linalg.solve(np.array([first, second], float).T, np.array(right, float))
    return float(x), float(y)


def as_printed(first: float, second: float, right: Any) -> tuple[float, float]:
    """Return what a system gives with the printed matrix: (cos, sin) in the second column."""
    swapped = np.array([sind(second), cosd(second)])
    return solve2(unit(first), swapped, right)


def pair(values: tuple[float, float], places: int = 3) -> str:
    return f"({fixed(values[0], places)}, {fixed(values[1], places)})"


def reasons() -> list[str]:
    """Return the deviations traced to their origin, by the article's own equations."""
    P = printed_value
    ours, slipped = quantities(pose()), quantities(pose(OF=USED_OF))
    of = sign(str(USED_OF))
    vB = np.array([P("vBx"), P("vBy")])
    own_v = solve2(unit(90 - P("gamma")), -unit(90 - P("delta")), -vB)
    residual = vB + P("vEB") * unit(90 - P("gamma")) - P("vE") * unit(90 - P("delta"))
    right45 = -np.array([P("PrX45"), P("PrY45")])
    own45 = solve2(unit(P("angCBt")), -unit(0), right45)
    row1 = (-P("PrX45") - P("aC")) / cosd(P("angCBt"))
    right67 = -np.array([P("PrX67"), P("PrY67")])
    own67 = solve2(unit(P("angEBt")), -unit(P("angEFt")), right67)
    right23 = -np.array([P("PrX23"), P("PrY23")])
    own23 = solve2(-unit(-13.239), unit(P("th3")), right23)
    low, high = (
        180 + np.degrees(np.arccos((P("aA3t") + s * 5e-4) / (P("aA3") - s * 5e-4))) - 13.239
        for s in (1, -1)
    )
    chain: list[tuple[str, str, float, str]] = [
        ("φ2", "13.237", np.degrees(np.arcsin(GIVEN["OA"] * cosd(GIVEN["phi1"]) / GIVEN["GA"])),
         "the arcsine with the data as printed"),
        ("φ3", "38.664", 90 - GIVEN["phi1"] - 13.239, "90° less φ1 and the printed 13.239°"),
        ("δ", "60.66", slipped["delta"], f"mechdae with `set={{\"OF\": {of}}}`"),
        ("γ", "8.677", slipped["gamma"], f"mechdae with `set={{\"OF\": {of}}}`"),
        ("a_By", "-0.349", P("aB") * sind(P("angA3")), "its own a_B and angle 194.316°"),
        ("sum y, 4-5", "-0.28", P("aBy") + P("aCBny"), "−0.349 + 0.069"),
        ("a_CBt", "1.096", row1, "first row of its system with its sum x and a_C = 1.256"),
        ("a_CB", "1.01", np.hypot(P("aCBt"), P("aCBn")), "its own root of 1.096² + 0.104²"),
        ("v_EB", "0.621", own_v[0], "its own system with its v_B, γ and δ"),
        ("v_E", "0.932", own_v[1], "its own system with its v_B, γ and δ"),
        ("ω6", "1.15", P("vEB") / GIVEN["BE"], "0.621/0.54"),
        ("ω7", "3.093", P("vE") / GIVEN["EF"], "0.932/0.3013"),
        ("a_EFn", "2.883", P("vE") ** 2 / GIVEN["EF"], "0.932²/0.3013"),
        ("a_EFn x", "-1.413", P("aEFn") * cosd(P("angEFn")), "2.883 at 119.34°"),
        ("a_EFn y", "2.513", P("aEFn") * sind(P("angEFn")), "2.883 at 119.34°"),
        ("a_EBn", "0.714", P("vEB") ** 2 / GIVEN["BE"], "0.621²/0.54"),
        ("a_EBn x", "-0.706", P("aEBn") * cosd(P("angEBn")), "0.714 at 171.323°"),
        ("a_EBn y", "0.108", P("aEBn") * sind(P("angEBn")), "0.714 at 171.323°"),
        ("sum x, 6-7", "-3.563", P("aBx") + P("aEFnx") + P("aEBnx"), "its three addends"),
        ("sum y, 6-7", "2.252", P("aBy", True) + P("aEFny") + P("aEBny"), "its three addends"),
        ("a_EBt", "4.708", own67[0], "its own system, the matrix with the right signs"),
        ("a_EFt", "4.924", abs(own67[1]), "its own system, the matrix with the right signs"),
        ("a_E", "5.706", np.hypot(P("aEFt"), P("aEFn")), "root of 4.924² + 2.883²"),
    ]  # fmt: skip
    rows = []
    for name, printed, value, how in chain:
        gap = abs(value - float(printed))
        hit = "yes" if gap <= 1.5 * unit_of(printed) else "**no**"
        rows.append([name, sign(printed), text(value, 6), how, hit])
    lines = table("quantity | printed | recomputed | from | reproduces the print", rows)
    with_349 = solve2(unit(P("angCBt")), -unit(0), -np.array([P("PrX45"), P("aBy") + P("aCBny")]))
    y369 = P("aBy", True) + P("aCBny")
    with_369 = solve2(unit(P("angCBt")), -unit(0), -np.array([P("PrX45"), y369]))
    lines += [
        "Apart from misprints, four slips carry all the rest: v_EB with v_E, a_By, a_CBt, and F.",
        "",
        f"* **v_EB and v_E.** Put into the two scalar equations they belong to, the printed "
        f"values leave {fixed(abs(residual[0]), 3)} m/s and {fixed(abs(residual[1]), 3)} m/s "
        f"unbalanced; the same equations, with the rounded inputs of the article, are solved by "
        f"{fixed(own_v[0], 3)} and {fixed(own_v[1], 3)} m/s. mechdae: {fixed(ours['vEB'], 3)} and "
        f"{fixed(ours['vE'], 3)} m/s. How the printed values came about cannot be told from the "
        f"text. Both angular velocities, both normal accelerations (they take the square) and "
        f"the whole acceleration plan of the group inherit them.",
        f"* **a_By.** With −0.349 the article's system would give a_C = {fixed(with_349[1], 3)}; "
        f"with the −0.369 of its Table 2 it gives {fixed(with_369[1], 3)}. Printed is 1.256: the "
        f"right number was used and the wrong one printed.",
        f"* **a_CBt.** The system as printed in numbers is solved by {fixed(own45[0], 3)}, with "
        f"−0.369 by {fixed(with_369[0], 3)}; mechdae has {fixed(ours['aCBt'], 3)}. The printed "
        f"1.096 is "
        f"none of them, and the printed total 1.01 is not even the root of its own squares.",
        f"* **F.** Replacing 0.8727 by {USED_OF} moves δ from {fixed(ours['delta'], 4)}° to "
        f"{fixed(slipped['delta'], 4)}°, γ from {fixed(ours['gamma'], 4)}° to "
        f"{fixed(slipped['gamma'], 4)}°, v_EB to {text(slipped['vEB'], 8)}, v_E to "
        f"{text(slipped['vE'], 8)} and a_E from {text(ours['aE'], 8)} to {text(slipped['aE'], 8)}: "
        f"the slip explains the angles, not the velocities.",
        f"* **Angle of a_A3.** Half a unit in the last digit of 0.934 and of 1.054 moves the "
        f"result from {fixed(low, 2)}° to {fixed(high, 2)}°, which is why its 194.316° has three "
        f"digits too many; the components of the acceleration of B give "
        f"{fixed(ours['angA3'], 3)}°.",
        "",
    ]
    drawn = [row for rows in PRINTED.values() for row in rows if row.drawn and row.key != "aB"]
    closer = [
        row.name
        for row in drawn
        if abs(float(row.drawn) - ours[row.key]) < abs(float(row.printed) - ours[row.key])
    ]
    rest = [row.name for row in drawn if row.name not in closer]
    lines += [
        f"**What the comparison of methods shows.** Group 6-7 has {len(drawn)} quantities both "
        f"calculated and measured on the drawing. In {len(closer)} of them ({', '.join(closer)}) "
        f"the *drawing* is closer to the truth than the calculation; the exception is "
        f"{', '.join(rest)}. What the article compares is therefore its own slip in v_EB and "
        f"v_E, not two methods. (The drawn values are legible for Fig. 7 only; that of a_EFt is "
        f"82 mm at 0.0604 (m/s²)/mm, the one scale the other lengths agree with: 77 mm give "
        f"{fixed(77 * 0.0604, 2)}, 82 mm {fixed(82 * 0.0604, 2)}, 96 mm {fixed(96 * 0.0604, 2)}.)",
        "",
        "**The matrices.** The systems are printed with a sine above a cosine in the second "
        "column, at angles for which the cosine belongs above. Solved as printed they give:",
        "",
    ]
    printed_systems = [
        ["2-3, accelerations", pair(as_printed(-13.239, P("th3"), right23)),
         pair(own23), "(0.934, 1.657)"],
        ["4-5, accelerations", pair(as_printed(P("angCBt"), 0.0, right45)), pair(own45),
         "(1.096, 1.256)"],
        ["6-7, velocities", pair(as_printed(90 - P("gamma"), 90 + P("delta"), -vB)), pair(own_v),
         "(0.621, 0.932)"],
        ["6-7, accelerations", pair(as_printed(P("angEBt"), P("angEFt"), right67)), pair(own67),
         "(4.708, 4.924)"],
    ]  # fmt: skip
    lines += table(
        "system | matrix as printed | vectors as in the equation | printed answer", printed_systems
    )
    lines += [
        "The printed answers of 2-3 and 6-7 come from the right matrix, so the misprint is in "
        "the formula only. (The velocity system of 2-3 is right as printed: its second vector "
        "does stand at 90° less the angle named.)",
        "",
    ]
    return lines


DRAWN_V, DRAWN_A = 0.01, 0.0604
"""Scales of Fig. 7, per millimetre: that of velocities follows from 95 mm for 0.95 m/s."""
DRAWN = [
    ("v_E", "velocity-rocker.E", "95", DRAWN_V),
    ("v_EB", "velocity-coupler.E-coupler.B-relative", "63", DRAWN_V),
    ("a_B", "acceleration-rod.B", "26", DRAWN_A),
    ("a_EBn", "acceleration-coupler.E-coupler.B-normal", "12", DRAWN_A),
    ("a_EBt", "acceleration-coupler.E-coupler.B-tangential", "77", DRAWN_A),
    ("a_EFn", "acceleration-rocker.E-rocker.F-normal", "50", DRAWN_A),
    ("a_EFt", "acceleration-rocker.E-rocker.F-tangential", "82", DRAWN_A),
    ("a_E", "acceleration-rocker.E", "96", DRAWN_A),
]
"""Lengths in Fig. 7 [mm] with the arrows of our plans."""


def plans() -> list[str]:
    """Return our plans beside the lengths measured on those of the article."""
    scene = read_scene(pose())
    ours = [motion_plan(pose(), scene, 0, word) for word in ("velocity", "acceleration")]
    closed = below(max(plan.gap / plan.size for plan in ours), 1e-14)
    lengths = {arrow.gid: arrow.length for plan in ours for arrow in plan.arrows}
    body = []
    for name, gid, drawn, scale in DRAWN:
        true = lengths[gid] / scale
        value = float(drawn) * scale
        row = [name, drawn, fixed(true, 2), text(value, 4), text(lengths[gid], 6)]
        body.append([*row, percent(float(drawn), true)])
    return [
        "![Plans of velocities and accelerations](../../../plots/seven_link_plans.svg)",
        "",
        f'`md.plot(result, "plans")`: vectors from the result, open by {closed} of their size. '
        "The lengths that Fig. 7 of the article gives beside those that the same vectors have on "
        "our plans at its scales, 0.01 (m/s)/mm and 0.0604 (m/s²)/mm:",
        "",
        *table("vector | drawn, mm | ours, mm | drawn | mechdae | drawn, %", body),
    ]


def errata() -> list[str]:
    """Return the errata list of article 000."""
    P = printed_value
    p2, q = P("pk"), P("qk")
    rough = -p2 + np.sqrt(max(p2**2 - q, 0.0))
    ours = quantities(pose())
    return [
        "1. v_EB, v_E and all that follows from them in group 6-7.",
        "2. a_CBt and a_CB; a_C is right, so the article's own first equation is violated.",
        "3. a_By in Table 1 and the sum y of group 4-5; a_C was computed with the right value.",
        f"4. F: 0.8727 in the data, {USED_OF} in every formula for E.",
        "5. The second columns of the acceleration systems and of the velocity system of 6-7.",
        "6. Signs that magnitudes hide (ω1 is clockwise): the rod turns at "
        f"{fixed(float(pose().bodies['rod'].angular_velocity[0]), 3)} rad/s and is accelerated by "
        f"{fixed(float(pose().bodies['rod'].angular_acceleration[0]), 3)} rad/s², so a_A3t points "
        "against v_A3; the block slides towards G at "
        f"{fixed(float(pose().joints['slot'].slide_velocity[0]), 3)} m/s; a_C is "
        f"{fixed(float(pose().points['slider.C'].acceleration[0, 0]), 3)} m/s², towards O.",
        "7. a_CBn is said to point from B to C; the angle 138.36° that is used points from C to B, "
        "which is right.",
        "8. Misprints: 13.237 and 13.329 for 13.239; 38.664 for 38.644; 0.5859 for 0.5895; 9.934 "
        "for 0.934; 0.173 for 0.137; −1.73 for −1.173; cosines where the y components take sines; "
        "the fraction of ω6 is left over from ω4 (0.232/0.5179) and its value is not; a metre as "
        "the unit of ω7; the equations for a_C and a_E are announced as those of A3.",
        f"9. E_x is found as the difference of nearly equal squares: from the printed p and q "
        f"it is {fixed(rough, 3)}, not the printed 0.725 (mechdae {fixed(ours['xE'], 4)}); more "
        "digits were carried than are shown.",
        "10. The crank is no crank: with bodies 6 and 7 attached the mechanism does not turn "
        "fully (below).",
        "",
    ]


def crank_task(*, poses: int = 361, outputs: tuple[str, ...] | None = None) -> Any:
    driver = md.Driver(coordinate="crank.angle", from_=0, to=2 * np.pi, speed="omega1")
    return md.Sweep(driver=driver, poses=poses, outputs=outputs)


def crank_at(angle: float, outputs: tuple[str, ...] | None = None) -> Any:
    driver = md.Driver(coordinate="crank.angle", at=(float(angle),), speed="omega1")
    return md.solve(seven(), md.Sweep(driver=driver, outputs=outputs))


def crank_modes(angle_deg: float, outputs: tuple[str, ...] | None = None) -> Any:
    driver = md.Driver(coordinate="crank.angle", at=(float(np.radians(angle_deg)),))
    return md.solve(seven(), md.Modes(driver=driver, outputs=outputs))


def revolution() -> list[str]:
    """Return the section on the full revolution of article 000."""
    window = md.solve(seven(), "window")
    low, high = (np.degrees(v) for v in window.summary["limits"])
    turn = md.solve(seven(), crank_task())
    lost, failed = turn.summary["status"]["unassembled"], turn.summary["failed"][0]
    chain = ("rod", "slider.C", "slot", "guide")
    part = md.solve(seven(), crank_task(outputs=chain))
    p = seven().mechanism.values()
    tilt = float(np.arcsin(p["OA"] / p["OG"]))
    right, left = crank_at(-tilt), crank_at(np.pi + tilt, chain)
    B = {name: np.array(r.points["rod.B"].position[0]) for name, r in
         (("right", right), ("left", left))}  # fmt: skip
    F = np.array([p["OF"], 0.0])
    far, near = (float(np.hypot(*(B[name] - F))) for name in ("left", "right"))
    reach = p["BE"] + p["EF"]
    widest = float(np.sqrt(reach**2 - B["left"][1] ** 2) - abs(B["left"][0]))
    inside = md.solve(seven(), "window", set={"OF": float(np.floor(widest * 1e6) / 1e6)})
    outside = md.solve(seven(), "window", set={"OF": float(np.ceil(widest * 1e6) / 1e6)})
    if inside.summary["limits"] != [None, None] or None in outside.summary["limits"]:
        raise ArithmeticError("the bound of F does not separate full turns from windows")
    rates = [right.points["slider.C"].velocity[0, 0]] + [
        right.bodies[name].angular_velocity[0]
        for name in ("rod", "connecting_rod", "coupler", "rocker")
    ]
    stretched = md.solve(seven(), "window", poses=3)
    gaps = [
        abs(np.sin(stretched.bodies["coupler"].angle[k] - stretched.bodies["rocker"].angle[k]))
        for k in (0, -1)
    ]
    found = md.solve(seven(), "modes")
    xC = sorted({round(float(v), 9) for v in found.points["slider.C"].position[:, 0]})
    counted = [(a, crank_modes(a), crank_modes(a, ("slider.C",))) for a in range(0, 360, 30)]
    rows = [
        [f"{angle}°", str(full.summary["count"]), str(sub.summary["count"])]
        for angle, full, sub in counted
    ]
    proven = all(r.summary["proven"] for _, *both in counted for r in both)
    if not (proven and found.summary["proven"]):
        raise ArithmeticError("a number of modes is not proven")
    E, rocker = right.points["coupler.E"].position[0], right.bodies["rocker"].angle[0]
    lines = [
        "The article computes one pose. Over a whole turn of the crank mechdae finds:",
        "",
        f"* **Window.** The mechanism assembles for {text(low, 12)}° ≤ φ1 ≤ {text(high, 12)}°, "
        f"that is {text(high - low, 10)}° of 360°. Of {len(turn)} poses over a turn {lost} do not "
        f"assemble; named are the group {failed['name']} and its joint {failed['joint']}. At both "
        f"ends B, E and F lie on one line (sine of the angle at E "
        f"{below(max(gaps), 1e-6)}): the "
        "angular velocities of 6 and 7 grow without bound there.",
        f"* **Bodies 1-5 turn fully.** Without 6 and 7 all {len(part)} poses of the turn assemble.",
        f"* **What a full turn would take.** B is between {text(near, 9)} m and {text(far, 9)} m "
        f"from F, the dyad spans from {fixed(p['BE'] - p['EF'], 4)} to {fixed(reach, 4)} m. Needed "
        f"are BE + EF of at least {text(far, 9)} m, or F (on the x axis) within {text(widest, 9)} "
        "m of O.",
        f"* **Extremes of the rod and of C.** Crank and rod are square at φ1 = "
        f"{text(-np.degrees(tilt), 12)}° and {text(180 + np.degrees(tilt), 12)}°: the rod stands "
        f"at {text(np.degrees(right.bodies['rod'].angle[0]), 12)}° and "
        f"{text(np.degrees(left.bodies['rod'].angle[0]), 12)}°, C at "
        f"{text(right.points['slider.C'].position[0, 0], 12)} m and "
        f"{text(left.points['slider.C'].position[0, 0], 12)} m. Only the first lies inside the "
        f"window; there the rates of C and of bodies 3, 4, 6, 7 vanish together (largest "
        f"{below(float(np.abs(rates).max()), 1e-12)}), E is at ({text(E[0], 12)}, "
        f"{text(E[1], 12)}) and the rocker at {text(np.degrees(rocker), 12)}°.",
        f"* **Swing, stroke, time ratio** (of bodies 1-5): the rod swings "
        f"{text(np.degrees(part.summary['swing']['rod']), 11)}°, C has a stroke of "
        f"{text(part.summary['stroke']['guide'], 11)} m, the block slides "
        f"{text(part.summary['stroke']['slot'], 11)} m along the rod; the time ratio is "
        f"{text((np.pi + 2 * tilt) / (np.pi - 2 * tilt), 12)}.",
        f"* **Assembly modes** at the article's pose: {found.summary['count']}, proven "
        f"(1 for the rod, 2 for C at {' and '.join(text(v, 9) for v in xC)} m, 2 for E). The other "
        "way to assemble 6-7 puts E at "
        f"({', '.join(text(v, 12) for v in _lower(found))}).",
        "",
        "Number of modes over the turn (all proven):",
        "",
    ]
    return lines + table("φ1 | all bodies | bodies 1-5", rows)


def forces() -> list[str]:
    """Return the forces of the groups at the article's pose."""
    result = md.solve("seven-link-forces", "pose")
    rows = []
    for group in reversed(result.summary["groups"]):
        bodies = group["bodies"]
        reactions = [
            f"{name} {text(np.hypot(*result.joints[name].reaction[0][:2]), 6)}"
            for name, joint in md.load("seven-link-forces").mechanism.joints.items()
            if joint.second_body in bodies and joint.first_body not in bodies
        ]
        rows.append((group["name"], ", ".join(reactions)))
    whole, without = (result.value(f"{word}/crank.angle")[0]
                      for word in ("efforts", "efforts_uncoupled"))  # fmt: skip
    return [
        "For forces the article refers to books (references 1 and 5) and has no example. "
        "`seven-link-forces` is one, with masses, loads and friction of our own. The groups are "
        "solved from the last to the first; `mechdae plot seven-link-forces --task pose --kind "
        "plans --which force --group II.3` draws the polygon of one. The crank needs "
        f"{text(whole, 8)} N m, without friction {text(without, 8)} N m. A test compares all "
        "reactions with free bodies of the seven links, to 1e-12.",
        "",
        *table("group | reactions on it from the groups before, N", rows),
    ]


def _lower(found: Any) -> Any:
    """Return E on the mode with the right C and the lower E."""
    label = found.labels.index(("+", "+", "+"))
    return found.points["coupler.E"].position[label]


def ground_length() -> float:
    phi1 = np.radians(GIVEN["phi1"])
    across, up = GIVEN["OA"] * np.cos(phi1), GIVEN["OA"] * np.sin(phi1)
    og = float(np.sqrt(GIVEN["GA"] ** 2 - across**2) - up)
    below(abs(og - seven().mechanism.values()["OG"]), 1e-12)
    return og


PLACES: list[tuple[str, ...]] = [
    ("Fig. 1, scheme", f"`mechdae plot {SEVEN} --task pose`", "seven_link_diagram"),
    ("data",
     "[file](../../../problems/gorshkov-seven-link.toml); what they leave open: above"),
    ("mobility by Chebyshev, structural formula", f"`mechdae show {SEVEN}`; above"),
    ("Fig. 2, plan of positions to scale and Assur groups",
     "`--kind groups`, `--scale`; [groups](../../reference/pictures.md#groups)",
     "seven_link_groups"),
    ("Fig. 3, angles φ, ψ, δ, γ", "`--angles`; [options](../../reference/symbols.md#options)",
     "seven_link_angles"),
    ("coordinates and angles, coefficients P1, P2, a1, b1, p, q of E",
     "[numbers](#every-printed-number); [positions](#the-explanation-beside-the-article) of II.1"),
    ("Fig. 4, group 2-3, equation (1), Coriolis part",
     "[II.3](#the-explanation-beside-the-article)", "seven_link_group_2_3"),
    ("Fig. 5 and Table 1, group 4-5", "[II.2](#the-explanation-beside-the-article)",
     "seven_link_group_4_5"),
    ("Figs. 6, 7 and Table 2, group 6-7", "[II.1](#the-explanation-beside-the-article)",
     "seven_link_group_6_7"),
    ("linear systems of velocities and accelerations",
     "below each pair of equations of [the explanation](#the-explanation-beside-the-article)"),
    ("graphic against analytic method", "[plans](#the-plans-drawn-and-computed)",
     "seven_link_plans"),
    ("force analysis by the same method (refs 1, 5)", "[forces](#forces)"),
]  # fmt: skip
"""Parts of the article, where they are here, and their pictures."""


def lines() -> list[str]:
    """Return the section of the page."""
    joints, bodies = len(seven().mechanism.joints), len(seven().mechanism.bodies)
    return [
        "## Seven-link lever mechanism",
        "",
        "A. D. Gorshkov, V. E. Primostka, *Application of the analytical method in the kinematic "
        "analysis of planar multi-link mechanisms*, European research (article 000). Problem "
        f"`{SEVEN}`.",
        "",
        f"Structure: {bodies} moving bodies, {joints} joints of one freedom, "
        f"W = 3·{bodies} − 2·{joints} = {3 * bodies - 2 * joints}; "
        f"{pose().summary['formula']}. Both last dyads hang on the pin B of the rod, side by side; "
        "the article's formula has them in a row.",
        "",
        f"Two things the data leave open. l_GA = {GIVEN['GA']} m is no length of a body but the "
        "distance at this pose: it gives G = (0, −OG) with OG = √(l_GA² − (OA cos φ1)²) − "
        f"OA sin φ1 = {text(ground_length(), 12)} m. And the direction of v_A makes the crank turn "
        "clockwise (ω1 = −4 rad/s), which magnitudes alone do not show.",
        "",
        *places(PLACES),
        "### Every printed number",
        "",
        *every_number(),
        "### Where the deviations come from",
        "",
        "Each deviating number recomputed from what the article itself prints. Where the result "
        "is the printed one (within 1.5 units), the number is inherited or explained; where it "
        "is not, the slip was made there.",
        "",
        *reasons(),
        "### The plans, drawn and computed",
        "",
        *plans(),
        "### Errata",
        "",
        *errata(),
        "### The full revolution",
        "",
        *revolution(),
        "### Forces",
        "",
        *forces(),
    ]
