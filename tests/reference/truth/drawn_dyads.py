"""Random dyads."""

from __future__ import annotations

import numpy as np

from .drawn_places import Places

DYADS = ("rrr", "rrr", "rrp", "rpr", "bar", "prp", "rpp")


class Dyads(Places):
    """Adds dyads."""

    def add_rrr(self, kind):
        p, q = self.first_place(), self.place()
        sign = int(self.rng.choice([-1, 1]))
        if p[0] == q[0]:
            return self.forget()
        far = abs(self.where(p) - self.where(q))
        if far < 0.2 * self.scale:
            return self.forget()
        a, b = far * self.uniform(0.4, 1.6), far * self.uniform(0.4, 1.6)
        if self.family == "toggle" and self.rng.random() < 0.6:
            b = abs(far - a) * (1 + 10.0 ** self.uniform(-4, -1))
        if self.family == "slender":
            a = far * 10.0 ** self.uniform(0, 4)
            b = a + far * self.uniform(-0.8, 0.8)
            b = b if b > 0.1 * far else a
        first = self.frame(self.link(a))
        self.joint("revolute", p, (first, "p0"))
        data = {"p": p, "q": q, "a": first, "b": None}
        if kind == "bar":
            data["length"] = float(b)
            self.joint("distance", q, (first, "p1"), length=float(b))
        else:
            data["b"] = second = self.frame(self.link(b))
            self.joint("revolute", q, (second, "p0"))
            self.joint("revolute", (first, "p1"), (second, "p1"))
        return self.done(kind, sign, data, self.uses(p, q))

    def block(self):
        offset = self.vector(0.4) * self.rng.choice([0, 1])
        return self.frame({"p1": 0j, "guided": offset, "p2": self.vector()})

    def add_rrp(self, kind):
        p, q = self.first_place(), self.place()
        sign = int(self.rng.choice([-1, 1]))
        if p[0] == q[0]:
            return self.forget()
        length = self.uniform(0.5, 3) * self.scale
        if self.family == "slender":
            length *= 10.0 ** self.uniform(0, 4)
        data = {"p": p, "g": q, "a": self.frame(self.link(length)), "b": None, **self.spec()}
        self.joint("revolute", p, (data["a"], "p0"))
        if self.rng.random() < 0.7:
            data["b"] = self.block()
            self.joint("revolute", (data["a"], "p1"), (data["b"], "p1"))
            self.guide(q, (data["b"], "guided"), data)
        else:
            data.update(swap=False, turn=0.0)
            self.joint("slot", q, (data["a"], "p1"), axis=data["axis"])
        return self.done(kind, sign, data, self.uses(p, q))

    def add_rpr(self, kind):
        p, q = self.first_place(), self.place()
        sign = int(self.rng.choice([-1, 1]))
        if p[0] == q[0] or abs(self.where(p) - self.where(q)) < 0.2 * self.scale:
            return self.forget()
        slot = self.vector(0.5) * self.rng.choice([0, 1])
        first = self.frame({"p0": 0j, "slot": slot, "p2": self.vector()})
        data = {"p": p, "q": q, "a": first, "b": None, **self.spec()}
        if slot == 0:  # one and the same spot is one point
            data["swap"] = data["swap"] and False
        self.joint("revolute", p, (first, "p0"))
        if self.rng.random() < 0.7:
            data["b"] = self.block()
            self.joint("revolute", q, (data["b"], "p1"))
            self.guide((first, "slot"), (data["b"], "guided"), data)
        else:
            data.update(swap=False, turn=0.0)
            self.joint("slot", (first, "slot"), q, axis=data["axis"])
        return self.done(kind, sign, data, self.uses(p, q))

    def add_prp(self, kind):
        p, q = self.first_place(), self.place()
        if p[0] == q[0]:
            return self.forget()
        data = {"g": p, "h": q, "guide_a": self.spec(), "guide_b": self.spec()}
        for on, key in ((p, "a"), (q, "b")):
            points = {"p1": 0j, "guided": self.vector(0.4), "p2": self.vector()}
            data[key] = self.frame(points)
            self.guide(on, (data[key], "guided"), data[f"guide_{key}"])
        self.joint("revolute", (data["a"], "p1"), (data["b"], "p1"))
        return self.done(kind, 0, data, self.uses(p, q))

    def add_rpp(self, kind):
        p, q = self.first_place(), self.place()
        if p[0] == q[0]:
            return self.forget()
        outer, inner = self.spec(), {"axis": self.angle(), "turn": self.angle()}
        data = {"p": p, "g": q, "guide_b": outer, "guide_a": inner}
        data["b"] = block = self.frame(
            {"guided": self.vector(0.4), "slot": self.vector(0.4), "p2": self.vector()}
        )
        data["a"] = arm = self.frame({"p0": 0j, "guided": self.vector(0.4), "p2": self.vector()})
        along = outer["axis"] if outer["swap"] else outer["axis"] - outer["turn"]
        if abs(np.sin(inner["axis"] - along)) < 0.3:
            return self.forget()
        self.guide(q, (block, "guided"), outer)
        self.joint(
            "prismatic", (block, "slot"), (arm, "guided"), axis=inner["axis"], turn=inner["turn"]
        )
        self.joint("revolute", p, (arm, "p0"))
        return self.done(kind, 0, data, self.uses(p, q))
