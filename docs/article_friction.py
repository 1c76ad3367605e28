"""Article 003 on the page of articles: formulas of friction and claims, with verdicts.

The article prints formulas and no numbers. What stands on the page beside them is computed by
mechdae from predefined problems, or by arithmetic on the formulas.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from article_text import below, fixed, places, table, text

import mechdae as md

CRANK, INERTIA = "slider-crank-friction", "slider-crank-inertia"
BLOCK, PIN = "quick-return-friction", "quick-return-pin"
POSE = 60
"""Place of the pose at 60 degrees in tasks of 361 poses."""
RATIOS = ("1/3", "0.9")
COEFFICIENTS = (0.05, 0.1, 0.2, 0.4)


@cache
def cycle(name: str, radius: str = "exact") -> Any:
    """Return the cycle of a predefined problem."""
    problem = md.load(name)
    return md.solve(problem, replace(problem.tasks["cycle"], friction_radius=radius))


def losses(result: Any, k: int, suffix: str = "") -> dict[str, float]:
    """Return the losses of the joints at a pose."""
    key = "loss" + suffix
    return {name: float(own[key][k]) for name, own in result.joints.items() if key in own}


def size(reaction: Any) -> float:
    return float(np.hypot(*reaction[:2]))


# -- formulas ----------------------------------------------------------------------------------


def formulas() -> list[str]:
    """Return the table of the article's formulas."""
    run = cycle(CRANK)
    p = run.mechanism.values()
    f, w = p["f"], p["omega"]
    guide, pin = run.joints["slide"], run.joints["B"]
    total = size(guide.reaction[POSE]) / abs(float(guide.normal[POSE]))
    total_gap = abs(total / np.sqrt(1 + p["f_slide"] ** 2) - 1)
    rho = p["r_B"] * np.sin(np.arctan(f))
    moment_gap = abs(float(pin.reaction[POSE, 2]) / (rho * size(pin.reaction[POSE])) - 1)
    over = ", ".join(
        f"{fixed(100 * (np.sqrt(1 + c * c) - 1), 4)} % at f = {c:g}" for c in (0.1, 0.2, 0.3)
    )
    w2 = float(run.bodies["rod"].angular_velocity[POSE])
    right, wrong = abs(w2 - w), abs(w2 + w)
    return table(
        "formula | printed | verdict | why",
        [
            [
                "prismatic pair", "F_fr = f Fⁿ, φ = arctan f", "right",
                f"the total reaction is Fⁿ √(1 + f²): {below(total_gap, 1e-12)} in mechdae",
            ],
            [
                "revolute pair, (8)", "M = F r sin φ = F ρ", "right",
                f"F is the total reaction: {below(moment_gap, 1e-12)} in mechdae",
            ],
            [
                "friction circle", "ρ ≈ r tan φ = r f", "**too large**",
                f"by √(1 + f²) − 1: {over}",
            ],
            [
                "(9), revolute", "P = f F r \\|ω_i ± ω_j\\|", "right with ρ ≈ r f, **the sign is "
                "none**",
                "(the sign is damaged in the print at hand) with signed velocities it is always "
                "ω_i − ω_j; + belongs to magnitudes of links "
                f"that turn in opposite senses. At 60° pin B turns with {text(right, 10)} rad/s; "
                f"the other sign gives {text(wrong, 10)}, {fixed(100 * (wrong / right - 1), 1)} %",
            ],
            [
                "(9), prismatic", "P = f Fⁿ \\|v\\|", "right for a contact on one side",
                "a guide of length 2b with a moment \\|M\\| > b \\|N\\| bears at both ends, "
                "\\|N₁\\| + \\|N₂\\| > \\|N\\|: below",
            ],
            [
                "(10)", "η = (P(M) − P_fr) / P(M)", "**only if M balances friction already**",
                "M without friction leaves the input P + P_fr, hence η = P/(P + P_fr) = 1/(1 + x); "
                "(10) is 1 − x, lower by x²/(1 + x)",
            ],
        ],
    )  # fmt: skip


def short_guide() -> list[str]:
    """Return what a guide that bears at both ends loses."""
    problem = md.load(CRANK)
    mechanism = problem.mechanism
    joints = dict(mechanism.joints)
    task = replace(
        problem.tasks["cycle"],
        driver=md.Driver("crank.angle", at=("pi/3",), speed="omega"),
        cycle=False,
    )
    rows = []
    for length in (None, 0.02, 0.01, 0.005):
        joints["slide"] = replace(mechanism.joints["slide"], contact_length=length)
        run = md.solve(replace(mechanism, joints=joints), task)
        guide = run.joints["slide"]
        lever = abs(float(guide.reaction[0, 2]) / float(guide.normal[0]))
        shown = "long" if length is None else f"{1000 * length:g} mm"
        rows.append([shown, f"{text(1000 * lever, 6)} mm", text(guide.loss[0], 8)])
    return [
        "**Guide that tilts.** The friction of pin C is a moment on the slider. At 60°, with the "
        "length 2b of the guide:",
        "",
        *table("2b | lever M/N | loss in the guide, W", rows),
    ]


def pose_table() -> list[str]:
    """Return the pose at 60 degrees with and without feedback."""
    rows = []
    for name, what in ((CRANK, "no masses"), (INERTIA, "with masses, 40 rad/s")):
        run = cycle(name)
        free, whole = run.parts["uncoupled"]["crank.angle"][POSE], run.efforts["crank.angle"][POSE]
        guide, pin = run.joints["slide"], run.joints["O"]
        quantities = {
            "effort of the crank, N m": (free, whole),
            "\\|R\\| in O, N": (size(pin.reaction_uncoupled[POSE]), size(pin.reaction[POSE])),
            "N of the guide, N": (guide.reaction_uncoupled[POSE, 1], guide.normal[POSE]),
            "sum of losses, W": (
                sum(losses(run, POSE, "_uncoupled").values()),
                sum(losses(run, POSE).values()),
            ),
        }
        for title, (without, with_) in quantities.items():
            ratio = fixed(100 * (float(with_) / float(without) - 1), 3)
            rows.append([f"{title} ({what})", text(without, 10), text(with_, 10), f"{ratio}"])
    return table("at 60° | without feedback | coupled | coupled is larger by, %", rows)


def cycles() -> list[str]:
    """Return the table of the four cycles."""
    rows = []
    for name in (CRANK, INERTIA, BLOCK, PIN):
        s = cycle(name).summary
        rows.append(
            [
                f"`{name}`", text(s["loss_uncoupled"], 8), text(s["loss"], 8),
                text(s["efficiency_formula_10"], 8), text(s["efficiency_uncoupled"], 8),
                text(s["efficiency"], 8),
            ]
        )  # fmt: skip
    head = "cycle | loss by (9), W | loss coupled, W | η by (10) | P/(P + P_fr) | η coupled"
    slow, fast = cycle(CRANK).summary["useful"], cycle(INERTIA).summary["useful"]
    article = cycle(CRANK, "article").summary
    return [
        *table(head, rows),
        "Formula (10) with the moment without friction is too low in each of them, by up to "
        f"{fixed(100 * max(_low(name) for name in (CRANK, INERTIA, BLOCK, PIN)), 1)} points. "
        "A mean over the cycle is the ratio of its integrals, not the mean of ratios; the power of "
        "masses vanishes over it: useful power at 40 rad/s is four times that at 10 rad/s "
        f"({below(abs(fast / (4 * slow) - 1), 1e-10)}). With ρ = r f the first cycle has η = "
        f"{text(article['efficiency'], 8)} coupled and {text(article['efficiency_formula_10'], 8)} "
        "by (10).",
        "",
    ]


def _low(name: str) -> float:
    s = cycle(name).summary
    return float(s["efficiency"] - s["efficiency_formula_10"])


# -- the exact identity ------------------------------------------------------------------------


@cache
def stroke(ratio: str, f: float) -> Any:
    """Return the working stroke of a slider-crank whose guide alone rubs, r = ratio l."""
    task = md.Reactions(
        driver=md.Driver("crank.angle", from_=0.0, to="pi", speed=10.0), poses=37, cycle=True
    )
    values = {"f": 0, "f_slide": f, "r": f"({ratio})*0.3", "l": 0.3, "Q_return": 1000.0}
    return md.solve(CRANK, task, set=values)


def identity() -> list[str]:
    """Return the table of the slider-crank with friction in its guide alone."""
    rows, worst = [], 0.0
    for ratio in RATIOS:
        for f in COEFFICIENTS:
            run = stroke(ratio, f)
            guide = run.joints["slide"]
            lean = np.tan(np.abs(run.bodies["rod"].angle))
            inner = slice(1, -1)
            own = guide.loss[inner] / guide.loss_uncoupled[inner]
            worst = max(worst, float(np.abs(own * (1 - f * lean[inner]) - 1).max()))
            s = run.summary
            middle = len(run) // 2
            lock = 1 / float(lean[middle])
            rows.append(
                [
                    f"{ratio} (f = {text(lock, 8)})", f"{f:g}", text(own[middle - 1], 8),
                    text(s["efficiency_formula_10"], 8), text(s["efficiency_uncoupled"], 8),
                    text(s["efficiency"], 8),
                ]
            )  # fmt: skip
    jammed = stroke("0.9", 0.5)
    (arc,) = jammed.summary["jammed_arcs"]
    return [
        "A slider-crank without masses, with friction in the guide alone, has the force "
        "S = Q/(cos β − f \\|sin β\\|) in its rod, β being the angle of the rod. The loss with "
        "feedback is 1/(1 − f tan \\|β\\|) of that without (mechdae agrees: "
        f"{below(worst, 1e-12)}), and the efficiency at a pose is 1 − f tan \\|β\\|: just what "
        "(10) gives with the moment *without* friction, because its two errors cancel. Over a "
        "stroke (10) is slightly too high. The mechanism jams at f = cot β_max, where 1 − f tan β "
        "vanishes; the mean does not show it: for r/l = 0.9 and f = 0.5, jammed between "
        f"{' and '.join(text(np.degrees(end), 8) for end in arc)} degrees, (10) still has "
        f"{text(jammed.summary['efficiency_formula_10'], 8)}.",
        "",
        *table(
            "r/l (jams at) | f | largest ratio of losses | η by (10) | P/(P + P_fr) | η coupled",
            rows,
        ),
    ]


# -- driven by the slider ----------------------------------------------------------------------


def load_driven(low: float, high: float, poses: int) -> Any:
    """Return the slider-crank driven by a constant force that always acts along the motion."""
    task = md.Reactions(
        driver=md.Driver("crank.angle", from_=low, to=high, speed=10.0),
        poses=poses,
        direction="load",
    )
    return md.solve(CRANK, task, set={"Q_return": 1000.0})


def dead_zone(low: float, high: float, coupled: bool) -> float:
    """Return where the output becomes zero between two angles, by narrowing the interval."""
    while high - low > 1e-13:
        run = load_driven(low, high, 65)
        places = run.drivers["crank.angle"].position
        if coupled:
            output = -run.efforts["crank.angle"]
        else:
            lost = sum(own.loss_uncoupled for own in run.joints.values())
            output = -run.parts["uncoupled"]["crank.angle"] - lost / 10.0
        change = np.flatnonzero(np.diff(np.sign(output)))
        low, high = float(places[change[0]]), float(places[change[0] + 1])
    return (low + high) / 2


def self_locking() -> list[str]:
    """Return the dead zones and the output torque of the slider-crank driven by its slider."""
    ends = [
        [np.degrees(dead_zone(*span, coupled)) for span in ((0.02, 0.05), (3.08, 3.12))]
        for coupled in (True, False)
    ]
    run = load_driven(0.0, float(np.pi), 181)
    rows = []
    for degrees in (20, 60, 90, 120):
        lost = sum(losses(run, degrees, "_uncoupled").values())
        free = -run.parts["uncoupled"]["crank.angle"][degrees]
        whole = -run.efforts["crank.angle"][degrees]
        rows.append([f"{degrees}°", *(text(v, 9) for v in (free, free - lost / 10.0, whole))])
    return [
        "**Driven by the slider** (1000 N along the motion, all joints rub) the crank gets no "
        f"torque within {text(ends[0][0], 9)}° after the outer and {text(180 - ends[0][1], 9)}° "
        f"before the inner dead centre; with (9) it would be {text(ends[1][0], 9)}° and "
        f"{text(180 - ends[1][1], 9)}°. Output torque, N m:",
        "",
        *table("φ | without friction | less losses by (9) | coupled", rows),
    ]


# -- the vector of no length -------------------------------------------------------------------


def zero_vector() -> list[str]:
    """Return what a block with a pin loses, and a pin in the slot itself."""
    rows = []
    for degrees in (30, 250):
        block, pin = losses(cycle(BLOCK), degrees), losses(cycle(PIN), degrees)
        both, one = block["A"] + block["slot"], pin["slot"]
        values = [block["A"], block["slot"], both, one]
        rows.append([f"{degrees}°", *(text(v, 8) for v in values)])
    means = [cycle(name).summary["loss_by_joint"] for name in (BLOCK, PIN)]
    values = [means[0]["A"], means[0]["slot"], means[0]["A"] + means[0]["slot"], means[1]["slot"]]
    rows.append(["cycle", *(text(v, 8) for v in values)])
    return [
        "**Pairs that turn and slide (Figs. 5 and 6).** The article adds a vector of no length "
        "and counts one turning and one sliding loss. That is right for a block with a pin of its "
        "own. A pin of radius r that slides in the slot itself is one contact with the one "
        "sliding speed \\|ṡ ∓ r (ω1 − ω3)\\|: the sum of two losses is too large wherever both "
        "parts have the same sense. Quick return with the same dimensions, losses in W:",
        "",
        *table("φ | pin of the block | slot | sum | pin in the slot itself", rows),
    ]


# -- claims ------------------------------------------------------------------------------------


def claims() -> list[str]:
    """Return the table of claims."""
    wankel = md.solve("wankel-rotor", "leaning")
    p = wankel.mechanism.values()
    K = p["R"] / p["e"]
    lean = float(wankel.outputs["leaning0"]["value"][0])
    bend = wankel.outputs["curvature0"]["value"]
    sarich = md.solve("sarich-engine", "turn")
    s = sarich.mechanism.values()
    slot = sarich.joints["slot0"]
    reach = float(np.abs(slot.slide_acceleration).max()) / (s["e"] * s["omega"] ** 2)
    motion = sarich.summary["stroke"]["slot0"] / (2 * s["e"])
    return table(
        "claim | verdict | why",
        [
            [
                "any structural scheme can be mapped to vector loops", "right, in the plane",
                "`md.loops_of`, "
                "[`show --loops`](../../reference/vector-loops.md#the-loops-of-a-mechanism): the "
                "seven-link mechanism has three loops and the modules lα, lα, αα",
            ],
            [
                "4 planar modules", "right",
                "two unknowns among lengths and angles: both of one vector, or ll, lα, αα of two",
            ],
            [
                "20 spatial modules", "right as a count, **19 are usable**",
                "1 + 9 + 10; with three unknown azimuths the vertical equation holds no unknown: "
                "there is no solution or there are infinitely many",
            ],
            [
                "a loop of four vectors has 3 variations", "right",
                "(m − 1)!/2 cyclic orders up to direction",
            ],
            [
                "a hinged four-bar has 1296 executions", "**open**",
                f"not derived. 6⁴ = {6**4} would be six executions of each of four pins (which "
                "link carries the pin, overhung or forked); the three orders of the loop are not "
                f"in it: {6**4}/3 = {6**4 // 3} is no fourth power",
            ],
            [
                "friction needs no calculation beyond the usual one", "right for the estimate",
                "it leaves out what friction does to reactions, the moment of guides, the "
                "direction of the total reaction, jamming and sticking",
            ],
            [
                "the normal part of a reaction is the one found without friction", "**false**",
                f"N of the guide at 60° grows by {_growth()} %",
            ],
            [
                "Wankel: contact with a surface of variable curvature",
                "right, but line contact limits",
                f"the seal leans by up to arcsin(3/K), K = R/e = {K:g}: "
                f"{text(np.degrees(lean), 8)}° in mechdae "
                f"({below(abs(np.sin(lean) * K / 3 - 1), 1e-10)}). For 3 < K < 9 the "
                f"curvature changes its sign: here {text(bend.max(), 6)} and {text(bend.min(), 6)} "
                "per metre. Compared with a slider-crank of equal volume "
                "([three engines](engines.md)) the line of contact counts, its curvature changes "
                "the pressure by 2.7 %",
            ],
            [
                "Sarich: flat contacts, large travel, intense acceleration", "right, both less "
                "than of a piston ring",
                f"a vane moves by ± e in its slot ({below(abs(motion - 1), 1e-10)}) with e ω² "
                f"({below(abs(reach - 1), 1e-10)}) and as much along the face: mean sliding speed "
                "2 e ω/π in both contacts. The [three engines](engines.md) compare it",
            ],
        ],
    )  # fmt: skip


def _growth() -> str:
    guide = cycle(CRANK).joints["slide"]
    ratio = float(guide.normal[POSE]) / float(guide.reaction_uncoupled[POSE, 1])
    return fixed(100 * (ratio - 1), 1)


PLACES: list[tuple[str, ...]] = [
    ("Figs. 1, 2 and (1)-(5): vectors, their closure, scheme and vector model",
     "`--kind loops`; "
     "[loops of a mechanism](../../reference/vector-loops.md#the-loops-of-a-mechanism)",
     "seven_link_loops"),
    ("4 planar and 20 spatial modules, several solutions each",
     "`mechdae modules`, [modules](../../reference/vector-loops.md); "
     "[claims](#claims-about-mechanisms)"),
    ("composition of mechanisms, any function by vector loops",
     "[composition](../../how-to/composition.md), [schemes](../../how-to/schemes.md)",
     "target_schemes", "bean_schemes", "composition_fronts"),
    ("three orders of a loop, 1296 executions, constructions of each",
     "`mechdae variants`; [claims](#claims-about-mechanisms)", "ranked_constructions"),
    ("choice by experts within limits of size",
     "`mechdae rank`; [composition](../../how-to/composition.md)", "ranking_axes"),
    ("Wankel and Sarich engines: curvature, travel, accelerations",
     "problems `wankel-rotor`, `sarich-engine`; [claims](#claims-about-mechanisms)"),
    ("Fig. 3, (6), (7): friction of a sliding pair", "[formulas](#formulas-of-friction)"),
    ("Fig. 4, (8): friction circle of a pin",
     "[formulas](#formulas-of-friction); `--kind plans --which friction`", "quick_return_friction"),
    ("Figs. 5, 6: pairs that turn and slide, a vector of no length",
     f"problems `{BLOCK}`, `{PIN}`; [what feedback changes](#what-feedback-changes)"),
    ("(9), (10): losses and efficiency",
     "[feedback](#what-feedback-changes), [where (10) is exact](#where-formula-10-is-exact)",
     "slider_crank_losses", "efficiency_map"),
    ("dynamic analysis with friction (KDAM)", "[motion](../../reference/motion.md)"),
]  # fmt: skip
"""Parts of the article, where they are here, and their pictures."""


def lines() -> list[str]:
    """Return the section of the page."""
    return [
        "## Vector modelling with friction",
        "",
        "B. B. Kosenok, *Consideration of friction in vector modelling lever mechanisms*, Izvestia "
        "of the Samara Scientific Center of the Russian Academy of Sciences 13, no. 4(3), 2011, "
        f"pp. 1080-1082 (article 003). Problems `{CRANK}`, `{INERTIA}`, `{BLOCK}`, `{PIN}`, with "
        "dimensions of our own: the article prints formulas and claims, no numbers.",
        "",
        *places(PLACES),
        "### Formulas of friction",
        "",
        *formulas(),
        *short_guide(),
        "### What feedback changes",
        "",
        "Formulas (9) take the reactions without friction. Friction adds to them, and the added "
        "reactions rub again "
        "([coupled friction](../../reference/forces.md#coupled-or-as-in-the-article)).",
        "",
        *pose_table(),
        *cycles(),
        *self_locking(),
        *zero_vector(),
        "### Where formula (10) is exact",
        "",
        *identity(),
        "### Claims about mechanisms",
        "",
        *claims(),
    ]
