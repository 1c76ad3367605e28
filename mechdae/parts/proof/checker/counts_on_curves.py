"""Modes on curves: real poses are counted place by place along the whole curve."""

from __future__ import annotations

from flint import arb

from .arithmetic import LAST, ONE, ZERO, Dual, FalseClaim, ball, exact, field, inverse, need, root
from .counts import families_of
from .formulas import evaluate, repeats
from .plane import PlanarFrame, PlanarMechanism
from .theorems_in_plane import may_be_one, most_in_plane, wheels
from .tubes import solution

START = ONE / 7
"""Place on a curve that no contact is likely to be at."""
SHORTEST_PART = arb(2) ** -30
"""Of the whole curve."""


def count_of_group(
    m: PlanarMechanism, group: list[str], known: set[str], z: list[arb]
) -> tuple[int, str]:
    """Return how many poses a group has at most, or touches its curve in, others being as in z."""
    kinds = sorted((joint["kind"], name) for name, joint in m.joints_of(group, known).items())
    if all(kind != "curve" for kind, _ in kinds):
        return most_in_plane(m, group, known)
    (curve, name), (kind, guide) = kinds
    if (curve, kind, m.joints[name]["bodies"][1:]) != ("curve", "prismatic", group):
        return 0, f"no theorem here tells how many poses {group} has"
    return CurveContacts(m, group[0], name, guide, z).count(), "signs along the whole curve"


class CurveContacts:
    """A body on a guide that follows a curve of a known body, others being as in a pose z.

    From the place s on the curve the body's follows; its guide's equation is one of s alone.
    """

    def __init__(self, m: PlanarMechanism, body: str, curve: str, guide: str, z: list[arb]) -> None:
        self.m, self.body, self.curve = m, body, curve
        self.joint, self.guide, self.frames = m.joints[curve], m.joints[guide], m.placed(z)
        need(all(map(repeats, self.joint["curve"])), f"joints/{curve}", "has not the period 2 pi")
        first, second = self.guide["bodies"]
        base, sense = (first, 1) if second == body else (second, -1)
        self.angle = self.frames[base].angle + self.guide["turn"] * sense

    def height(self, share: arb) -> Dual:
        """Return how far the body is off its guide, with its derivative by s.

        `share`: the place of the contact, as part of the whole curve, in balls.
        """
        m, joint = self.m, self.joint
        s = Dual(share * arb.pi() * 2 + START, {0: ONE})
        x, y = (evaluate(f, s, self.curve) for f in joint["curve"])
        if "roller" in joint:
            vx, vy = (evaluate(f, s, self.curve) for f in joint["slopes"])
            r = inverse(root(vx * vx + vy * vy)) * joint["roller"]
            x, y = x + vy * r, y - vx * r
        carrier, point = joint["ends"][0]
        x, y = self.frames[carrier].rotated(x, y)
        start = m.place((carrier, point), self.frames)
        arm = PlanarFrame(ZERO, ZERO, self.angle).point(m.points[self.body][joint["ends"][1][1]])
        frame = PlanarFrame(x + start[0] - arm[0], y + start[1] - arm[1], self.angle)
        one, _, dx, dy = m.gap(self.guide, self.frames | {self.body: frame})
        return one.along(self.guide["axis"], dy, -dx)

    def count(self) -> int:
        """Return how often the height vanishes: part by part it keeps a sign, or is monotone."""
        parts, count = [(ZERO, ONE)], 0
        while parts:
            a, b = parts.pop()
            middle = (a + b) / 2
            h = self.height(middle + ball((b - a) / 2))
            if h.v > 0 or h.v < 0:
                continue
            if h.d[0] > 0 or h.d[0] < 0:
                signs = self.height(a).v * self.height(b).v
                count += bool(signs < 0)
                if signs < 0 or signs > 0:
                    continue
            if b - a < SHORTEST_PART:
                raise FalseClaim("modes", f"contacts of {self.body} that are too near each other")
            parts += [(a, middle), (middle, b)]
        return count


def _divided(m: PlanarMechanism, poses: list[list[arb]], group: list[str]) -> list[list[list[arb]]]:
    """Return poses by those that are one in a group."""
    turns = [m.at[body, "angle"] for body in {*group} & set[str]().union(*wheels(m))]
    families = families_of(poses, lambda one, other: may_be_one(m, group, one, other))
    for first, *others in families:
        alike = all((first[k] - z[k]).contains(0) for z in others for k in turns)
        need(alike, "modes", "one stands there twice, with whole turns that wheels tell")
    return families


def check_modes_on_curves(m: PlanarMechanism, data: dict[str, object]) -> str:
    """Check all poses at one value of the driver, and that there are no others."""
    s, groups = exact(field(data, "at", str, "modes"), "at"), field(data, "groups", list, "modes")
    poses, known, reasons = list[list[arb]](), {"ground"}, dict[str, int]()
    for k, mode in enumerate(field(data, "modes", list, "certificate")):
        at = f"modes/{k}"
        poses.append(m.agrees(solution(m, m.claimed(mode, s, at)).box(), mode, at))
        m.compare(poses[LAST], mode, at)
    families = [poses]
    for group in groups:
        divided = list[list[list[arb]]]()
        for family in families:
            parts = _divided(m, family, group)
            count, why = count_of_group(m, group, known, family[0])
            need(count in (len(parts), 0), "modes", f"{len(parts)} of {count} poses of {group}")
            divided, reasons[why] = divided + parts, count
        families, known = divided, known | {*group}
    alone = known == {"ground", *m.bodies} and all(len(family) == 1 for family in families)
    need(alone, "modes", "one stands there twice, or bodies are in no group")
    if not all(reasons.values()):
        why = next(why for why, count in reasons.items() if not count)
        return f"{len(poses)} modes exist; that there are no others is not claimed: {why}"
    return f"{len(poses)} modes, and no others: {', '.join(filter(None, reasons))}"
