"""Mechanisms near change points and double roots, on purpose."""

from __future__ import annotations

import numpy as np

from .drawn_dyads import DYADS
from .drawn_groups import Groups
from .drawn_places import Failed
from .unclosed import SYSTEMS


class Changes(Groups):
    """Adds what is near-singular on purpose."""

    def near_change(self):
        """A four-bar whose longest and shortest links nearly equal the others."""
        rng = self.rng
        self.begin()
        gap = 10.0 ** rng.uniform(-16, -2) * rng.choice([-1, 1])
        a = self.arm
        d, b = a * self.uniform(1.2, 4), a * self.uniform(1.2, 4)
        c = rng.choice([d + b - a, a + b - d, a + d - b])
        if c <= 0.1 * a:
            c = d + b - a
        c += gap * self.scale
        q = self.ground(self.origin + d * np.exp(1j * self.angle()))
        first, second = self.frame(self.link(b)), self.frame(self.link(c))
        self.four_bar(("crank", "p2"), q, first, second)
        self.case.notes.append(f"gap {gap:.1e}")
        data = {"p": ("crank", "p2"), "q": q, "a": first, "b": second}
        if not self.done("rrr", int(rng.choice([-1, 1])), data, (0,)):
            raise Failed

    def four_bar(self, p, q, first, second):
        self.joint("revolute", p, (first, "p0"))
        self.joint("revolute", q, (second, "p0"))
        self.joint("revolute", (first, "p1"), (second, "p1"))

    def through_change(self):
        """A parallelogram, a kite or an equal-legged slider-crank with exact numbers."""
        rng, case = self.rng, self.case
        self.begin()
        a = self.arm
        kind = str(rng.choice(["parallel", "kite", "galloway", "slider"]))
        case.notes.append(kind)
        case.crossings = str(rng.choice(["continue", "switch", "stop"], p=[0.6, 0.2, 0.2]))
        sign = int(rng.choice([-1, 1]))
        data = {"p": ("crank", "p2"), "meeting": kind}

        def bar(length, **more):
            points = {"p0": 0j, "p1": length, "p2": self.vector(), **more}
            return self.frame(points, plain=True)

        if kind == "slider":  # rod as long as the crank, the guide through its centre
            data |= {"g": ("ground", "O"), "a": bar(a), "axis": 0.0, "turn": 0.0}
            points = {"p1": 0j, "guided": 0j, "p2": self.vector()}
            data["b"] = block = self.frame(points, plain=True)
            self.joint("revolute", data["p"], (data["a"], "p0"))
            self.joint("revolute", (data["a"], "p1"), (block, "p1"))
            self.guide(data["g"], (block, "guided"), data)
            kept = self.done("rrp", sign, data, (0,))
        else:
            d = float(a * rng.integers(9, 30) / 8)
            b, c = {"parallel": (d, a), "kite": (a, d), "galloway": (d, d)}[kind]
            if kind == "galloway":
                d = a
            ox, oy = case.local["ground"]["O"]
            data["q"] = self.ground(complex(ox + d, oy))
            data["a"], data["b"] = bar(b), bar(c)
            self.four_bar(data["p"], data["q"], data["a"], data["b"])
            kept = self.done("rrr", sign, data, (0,))
        if not kept:
            raise Failed
        far = min(abs(np.sin(case.s0)), abs(np.cos(case.s0)))
        if far < 0.05:
            raise Failed
        for _ in range(int(rng.integers(0, 2))):
            for _ in range(20):
                if self.add(str(rng.choice(DYADS))):
                    break

    def near_saddle(self):
        """A platform on three legs, the third as long as where two branches meet, nearly.

        With the first two legs closed, the third's length is a function of driver and
        platform angle; where it is stationary and no extreme, branches meet.
        """
        rng = self.rng
        for _ in range(40):
            self.begin()
            if not self.add_triad("triad", ["bar", "bar", "bar"]):
                continue
            case = self.case
            element = case.elements[-1]
            spot = self._saddle(element)
            if spot is None:
                case.elements.pop()
                self.forget()
                continue
            gap = 10.0 ** rng.uniform(-10, -2) * rng.choice([-1, 1])
            u, root, length = spot
            leg = element.data["legs"][2]
            leg["length"] = float(length * (1 + gap))
            kind, name, a, b, keys = case.joints[-1]
            case.joints[-1] = (kind, name, a, b, {**keys, "length": leg["length"]})
            case.notes.append(f"gap {gap:.1e} at {u!r}")
            # a sketch somewhat before the near miss, on one of the branches there
            for off in rng.permutation([-0.5, -0.3, 0.3, 0.5]):
                case.s0 = float(u + off * case.unit)
                world = case.close([case.s0], upto=len(case.elements) - 1)
                roots = SYSTEMS["triad"](world, element).all_roots()
                if not roots:
                    continue
                near = sorted(roots, key=lambda r: abs(np.sin((r[2] - root[2]) / 2)))
                element.root = near[int(rng.integers(min(2, len(near))))]
                disc = self.world().discs[-1].c[0][0].real
                if disc > 1e-4:
                    return
            raise Failed
        raise Failed

    def _saddle(self, element):
        """Return driver value, platform and third length at a saddle of that length."""
        case = self.case
        k = len(case.elements) - 1
        legs = element.data["legs"]
        body = element.data["body"]
        x0 = np.array([case.s0 / case.unit, element.root[2]])

        def third(x):
            """Return the third leg's length for many (u, phi), on the sketch's side."""
            world = case.close(x[0] * case.unit, wide=False, upto=k)
            e = np.exp(1j * x[1])
            spots = [world.place(leg["on"]).c[0] for leg in legs]
            arms = [e * world.gap(body, "p0", leg["pin"]) for leg in legs]
            p, q = spots[0] - arms[0], spots[1] - arms[1]
            a2, b2 = legs[0]["length"] ** 2, legs[1]["length"] ** 2
            line = q - p
            d2 = abs(line) ** 2
            along = (d2 + a2 - b2) / (2 * d2)
            Z = p + line * (along + 1j * side * np.sqrt(a2 / d2 - along**2))
            return Z, np.abs(Z + arms[2] - spots[2])

        wanted = complex(*element.root[:2])
        side = -1  # of the branch on which the first two legs are closed
        if abs(third(x0[:, None])[0][0] - wanted) > 1e-6 * self.scale:
            side = 1
        h = 1e-4
        shifts = np.array(
            [(0, 0), (h, 0), (-h, 0), (0, h), (0, -h), (h, h), (h, -h), (-h, h), (-h, -h)]
        ).T
        starts = self.rng.uniform(-1.5, 1.5, (8, 2)) + x0
        for x in starts:
            for _ in range(30):
                _, f = third(x[:, None] + shifts)
                if not np.all(np.isfinite(f)):
                    break
                g = np.array([f[1] - f[2], f[3] - f[4]]) / (2 * h)
                H = (
                    np.array(
                        [
                            [(f[1] - 2 * f[0] + f[2]), (f[5] - f[6] - f[7] + f[8]) / 4],
                            [(f[5] - f[6] - f[7] + f[8]) / 4, (f[3] - 2 * f[0] + f[4])],
                        ]
                    )
                    / h**2
                )
                det = H[0, 0] * H[1, 1] - H[0, 1] ** 2
                if not np.isfinite(det) or det == 0:
                    break
                step = np.linalg.solve(H, g)
                size = float(np.abs(step).max())
                x = x - step * min(1.0, 0.3 / size if size else 1.0)
                if size < 1e-9:
                    if det < -1e-3 * self.scale**2 and abs(x[0] - x0[0]) < 3:
                        Z, f = third(x[:, None])
                        root = (Z[0].real, Z[0].imag, float(x[1]))
                        return float(x[0] * case.unit), root, float(f[0])
                    break
        return None
