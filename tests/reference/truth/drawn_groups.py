"""Random groups without a closed formula: triads, links with a gear."""

from __future__ import annotations

import numpy as np

from .drawn_wheels import Wheels

LEGS = ("link", "link", "bar", "slide", "slot", "rail", "groove")


class Groups(Wheels):
    """Adds triads and geared groups."""

    def add_triad(self, kind, legs=None):
        """A platform whose three pins are somewhere at the sketch, held by three legs."""
        rng, case, size = self.rng, self.case, self.scale
        long = 10.0 ** self.uniform(-0.3, 3) if self.family == "slender" else 1.0
        places = [self.first_place(), self.place(), self.place()]
        if len({place[0] for place in places}) == 1:
            return self.forget()
        spots = [self.where(place) for place in places]
        center = sum(spots) / 3 + self.vector(1.5)
        pins = [center + self.vector(1.2) for _ in range(3)]
        sides = [abs(pins[i] - pins[j]) for i, j in ((0, 1), (1, 2), (0, 2))]
        if min(sides) < 0.15 * size:
            return self.forget()
        angle = self.angle()
        shift = self.vector(2) * rng.choice([0, 1])
        turn = np.exp(-1j * angle)
        body = self.frame({}, plain=True)
        case.local[body] = {}
        for name, z in zip(("p0", "p1", "p2"), pins, strict=True):
            self.point(body, name, (z - center) * turn - shift)
        self.pin0 = pins[0]
        # the place of p0 and the angle at the sketch
        root = (pins[0].real, pins[0].imag, angle)
        data = {"body": body, "legs": []}
        chosen = legs or [str(rng.choice(LEGS)) for _ in range(3)]
        for number, (word, place, spot, pin) in enumerate(
            zip(chosen, places, spots, pins, strict=True)
        ):
            leg = {"kind": word, "on": place, "pin": f"p{number}"}
            self.leg(body, leg, spot, pin, angle, long)
            data["legs"].append(leg)
        return self.done(kind, 1, data, self.uses(*places), root=root)

    def leg(self, body, leg, spot, pin, angle, long):
        """Make one leg from a known place to the platform's pin."""
        rng, size, word = self.rng, self.scale, leg["kind"]
        plate = (body, leg["pin"])
        far = abs(pin - spot)
        if word in ("link", "bar"):
            if far < 0.1 * size or long > 1:  # a place further away, on the same body
                spot = pin + self.vector() + size * long * np.exp(1j * self.angle())
                leg["on"] = self.marked(leg["on"][0], spot)
                far = abs(pin - spot)
            if word == "bar":
                leg["length"] = float(far)
                self.joint("distance", leg["on"], plate, length=leg["length"])
                return
            points = self.link(far)
            leg["body"] = link = self.frame(points)
            self.joint("revolute", leg["on"], (link, "p0"))
            self.joint("revolute", (link, "p1"), plate)
            return
        leg |= self.spec()
        if word == "slot":
            leg.update(turn=0.0, swap=False)
        if word in ("slide", "slot"):  # a guide on the known body, through the pin
            known = leg["on"][0]
            direction = complex(self.world().direction(known).c[0][0])
            own = direction * np.exp(1j * leg["turn"] * (-1 if leg["swap"] else 1))
            along = (own if leg["swap"] else direction) * np.exp(1j * leg["axis"])
            through = pin
            if word == "slide":
                offset = self.vector(0.4) * rng.choice([0, 1])
                leg["body"] = self.frame({"p1": 0j, "guided": offset, "p2": self.vector()})
                local = self.case.local[leg["body"]]
                gap = complex(*local["guided"]) - complex(*local["p1"])
                through = pin + own * gap
            leg["on"] = self.marked(known, through + along * self.uniform(-1, 1) * size)
            if word == "slot":
                self.joint("slot", leg["on"], plate, axis=leg["axis"])
            else:
                self.guide(leg["on"], (leg["body"], "guided"), leg)
                self.joint("revolute", (leg["body"], "p1"), plate)
            return
        # a guide on the platform, through the known place
        turn = np.exp(1j * leg["turn"] * (-1 if leg["swap"] else 1))
        if word == "groove":
            leg.update(swap=False, turn=0.0)
            turn = 1.0
        axis = np.exp(1j * leg["axis"]) * (turn if leg["swap"] else 1.0)
        platform = np.exp(1j * angle)
        through = spot
        if word == "rail":
            offset = self.vector(0.4) * rng.choice([0, 1])
            leg["body"] = self.frame({"p1": 0j, "guided": offset, "p2": self.vector()})
            local = self.case.local[leg["body"]]
            through = spot + platform * turn * (complex(*local["guided"]) - complex(*local["p1"]))
        z = through + platform * axis * self.uniform(-1, 1) * size
        origin = complex(*self.case.local[body]["p0"])
        local = (z - self.pin0) / platform + origin
        name = f"s{leg['pin'][1]}"
        self.point(body, name, local)
        leg["pin"] = name
        if word == "groove":
            self.joint("slot", (body, name), leg["on"], axis=leg["axis"])
        else:
            self.guide((body, name), (leg["body"], "guided"), leg)
            self.joint("revolute", leg["on"], (leg["body"], "p1"))

    def add_geared(self, kind):
        """Links a and b in a row, b turned by a gear on a, held at its end by a bar or a link."""
        rng, case = self.rng, self.case
        p, q = self.first_place(), self.place()
        if p[0] == q[0]:
            return self.forget()
        others = ["ground", *case.bodies]
        other = others[int(rng.integers(len(others)))]
        a = self.frame(self.link(self.uniform(0.5, 1.5) * self.scale))
        b = self.frame(self.link(self.uniform(0.3, 1.0) * self.scale))
        ratio = float(rng.choice([-2.0, -1.0, -0.5, 2.0, 3.0, self.uniform(-3, 3)]))
        if abs(ratio) < 0.2 or abs(ratio - 1) < 0.2:
            ratio = -1.0
        first = bool(rng.random() < 0.5)
        phase, alpha = self.uniform(-2, 2), self.angle()
        known = float(self.world().angle(other).c[0][0].real)
        if first:
            beta = alpha + ratio * (known - alpha) + phase
        else:
            beta = alpha + (known - alpha - phase) / ratio
        local = case.local
        arm_a, arm_b = (
            complex(*local[body]["p1"]) - complex(*local[body]["p0"]) for body in (a, b)
        )
        pin = self.where(p) + arm_a * np.exp(1j * alpha) + arm_b * np.exp(1j * beta)
        far = abs(pin - self.where(q))
        if far < 0.2 * self.scale:
            return self.forget()
        leg = {"kind": str(rng.choice(["link", "bar"]))}
        self.joint("revolute", p, (a, "p0"))
        self.joint("revolute", (a, "p1"), (b, "p0"))
        pair = [(b, "p0"), (other, next(iter(local[other])))]
        one, two = pair if first else pair[::-1]
        self.joint("gear", one, two, ratio=ratio, phase=phase, carrier=a)
        if leg["kind"] == "bar":
            leg["length"] = float(far)
            self.joint("distance", (b, "p1"), q, length=leg["length"])
        else:
            leg["body"] = self.frame(self.link(far))
            self.joint("revolute", q, (leg["body"], "p0"))
            self.joint("revolute", (leg["body"], "p1"), (b, "p1"))
        data = {
            "p": p, "q": q, "a": a, "b": b, "other": other, "ratio": ratio, "phase": phase,
            "first": first, "leg": leg,
        }  # fmt: skip
        return self.done(kind, 1, data, self.uses(p, q, (other,)), root=(alpha,))
