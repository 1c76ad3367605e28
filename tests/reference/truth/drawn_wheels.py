"""Random gears, belts, racks, planets and welds."""

from __future__ import annotations

import numpy as np

from .drawn_dyads import Dyads

ROLLS = 0.6
"""Of the number by which the ratio of a gear is drawn: above, friction wheels of that ratio."""


class Wheels(Dyads):
    """Adds wheels, racks and welds."""

    def known(self):
        """Return a body whose angle is known: the crank, a wheel, or any moving body."""
        bodies = self.case.bodies
        sure = [
            b
            for b in bodies
            if self.case.elements[self.case.maker[b]].kind in ("crank", "gear", "pinion")
        ]
        pool = sure if sure and self.rng.random() < 0.7 else bodies
        return pool[int(self.rng.integers(len(pool)))]

    def add_gear(self, kind):
        rng = self.rng
        other, carrier = self.known(), "ground"
        on = self.ground(self.origin + self.vector(2))
        if kind == "planet":  # on a moving carrier, about a fixed or a moving sun
            carrier = self.known()
            on = (carrier, "p2")
            others = ["ground", *[b for b in self.case.bodies if b != carrier]]
            other = others[int(rng.integers(len(others)))]
            if "p2" not in self.case.local[carrier]:
                return self.forget()
        body = self.frame(self.link(self.scale * self.uniform(0.2, 0.7)))
        self.joint("revolute", on, (body, "p0"))
        first = bool(rng.random() < 0.5)
        phase = self.uniform(-2, 2)
        data = {
            "body": body, "on": on, "carrier": carrier, "other": other, "first": first,
            "phase": phase, "word": kind,
        }  # fmt: skip
        pair = [(body, "p0"), (other, next(iter(self.case.local[other])))]
        a, b = pair if first else pair[::-1]
        keys = {"phase": phase} | ({"carrier": carrier} if carrier != "ground" else {})
        if kind == "belt":
            data["crossed"] = bool(rng.random() < 0.5)
            data["word"] = "belt crossed" if data["crossed"] else "belt open"
            data["ratio"] = float(rng.choice([0.5, 1.0, 2.0, self.uniform(0.3, 3)]))
            keys |= {"ratio": data["ratio"], "crossed": data["crossed"]}
            self.joint("belt", a, b, **keys)
        else:
            drawn = rng.random()
            if drawn < 0.35:  # by teeth
                teeth = [int(z) for z in rng.integers(12, 60, 2)]
                mesh = str(rng.choice(["external", "internal"]))
                sense = -1 if mesh == "external" else 1
                data["ratio"] = sense * teeth[1] / teeth[0]
                keys |= {"teeth": teeth, "mesh": mesh}
            else:
                data["ratio"] = float(
                    rng.choice([-2.0, -0.5, 1.5, -1.0, 2.0, self.uniform(0.2, 3)])
                    * rng.choice([-1, 1])
                )
                keys["ratio"] = data["ratio"]
            rolls = kind == "gear" and drawn > ROLLS and data["ratio"] != 1.0
            if rolls:  # radii whose quotient is the ratio to the last bit
                contact = "internal" if keys.pop("ratio") > 0 else "external"
                keys |= {"radius": 0.0625, "second_radius": 0.0625 * abs(data["ratio"])}
                self.joint("friction-wheel", a, b, contact=contact, **keys)
                data["word"] = f"friction wheel {contact}"
            else:
                self.joint("gear", a, b, **keys)
            if kind == "gear" and not rolls:
                data["word"] = "gear internal" if data["ratio"] > 0 else "gear external"
        return self.done("gear", 0, data, self.uses(on, (carrier,), (other,)))

    def add_rack(self, kind):
        rng, case = self.rng, self.case
        wheel = self.known()
        carrier = "ground"
        on = self.place()
        if on[0] == wheel:
            return self.forget()
        spec = self.spec()
        body = self.frame({"p1": 0j, "guided": self.vector(0.4), "p2": self.vector()})
        lean = float(rng.choice([0.0, self.uniform(-0.9, 0.9)]))
        along = spec["axis"] if spec["swap"] else spec["axis"] - spec["turn"]
        tooth = float(along + lean + rng.choice([0.0, np.pi]))
        radius = self.uniform(0.2, 0.7) * self.scale * float(rng.choice([-1, 1]))
        center = (wheel, next(iter(case.local[wheel])))
        world = self.world()
        rolled = radius * float(world.angle(wheel).c[0][0].real)
        phase = -rolled + self.uniform(-1, 1) * self.scale
        data = {
            "g": on, "wheel": center, "carrier": carrier, "body": body, "tooth": tooth,
            "radius": radius, "phase": phase, **spec,
        }  # fmt: skip
        self.guide(on, (body, "guided"), spec)
        self.joint("rack", center, (body, "p1"), radius=radius, axis=tooth, phase=phase)
        return self.done(kind, 0, data, self.uses(on, (wheel,)))

    def add_pinion(self, kind):
        rng, case = self.rng, self.case
        rack = case.bodies[int(rng.integers(len(case.bodies)))]
        on = self.place()
        if on[0] == rack or "p2" not in case.local[rack]:
            return self.forget()
        body = self.frame(self.link(self.scale * self.uniform(0.2, 0.7)))
        radius = self.uniform(0.3, 0.9) * self.scale * float(rng.choice([-1, 1]))
        data = {
            "on": on, "rack": (rack, "p2"), "carrier": "ground", "body": body,
            "tooth": self.angle(), "radius": radius, "phase": self.uniform(-1, 1) * self.scale,
        }  # fmt: skip
        keys = {"radius": radius, "axis": data["tooth"], "phase": data["phase"]}
        self.joint("revolute", on, (body, "p0"))
        self.joint("rack", (body, "p0"), data["rack"], **keys)
        return self.done(kind, 0, data, self.uses(on, (rack,)))

    def add_weld(self, kind):
        on = self.place(moving=True)
        body = self.frame({"p0": 0j, "p2": self.vector()})
        data = {"on": on, "turn": self.angle(), "body": body}
        self.joint("weld", on, (body, "p0"), turn=data["turn"])
        return self.done(kind, 0, data, self.uses(on))
