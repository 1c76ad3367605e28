"""Rows of studies against `solve --set`: each set starts on the mode nearest to its own sketch.

    python -m tests.attack.study_rows --count 2000 --out docs/data/study-rows.json

Mechanisms of one to three dyads on a crank, dimensions and sketches random and changed from set to
set. The exit code is 1 where a row differs.
"""

from __future__ import annotations

import itertools
import sys

import numpy as np

import mechdae as md
from tests.shared import attack

ROWS = 40
"""Sets of one study."""
OFF = 1e-9


class Drawn:
    """A crank with dyads on it; every length, and what the sketch says, is a parameter."""

    def __init__(self, seed):
        self.rng = np.random.default_rng([seed, 24])
        self.parameters = {}
        self.ground = {"A": [0, 0]}
        self.bodies = {"crank": {"A": [0, 0], "B": [self.length("a", 0.4), 0]}}
        self.joints = [md.Revolute("A", "ground.A", "crank.A")]
        self.sketch = {"crank": 1.0}
        self.ends = [("crank", "B")]
        for k in range(int(self.rng.integers(1, 4))):
            getattr(self, str(self.rng.choice(["four", "slider", "slot"])))(k)

    def length(self, name, value):
        self.parameters[name] = value
        return name

    def said(self, key, name, value):
        if self.rng.random() < 0.85:
            self.parameters[name] = value
            self.sketch[key] = name

    def end(self):
        return self.ends[int(self.rng.integers(len(self.ends)))]

    def four(self, k):
        """A coupler and a rocker."""
        body, point = self.end()
        self.ground[f"D{k}"] = [self.length(f"d{k}", 1.0 + 0.2 * k), 0]
        b, c = self.length(f"b{k}", 1.2), self.length(f"c{k}", 1.1)
        self.bodies[f"coupler{k}"] = {"B": [0, 0], "C": [b, 0], "P": [0.5, 0.3]}
        self.bodies[f"rocker{k}"] = {"D": [0, 0], "C": [c, 0]}
        self.joints += [
            md.Revolute(f"B{k}", f"{body}.{point}", f"coupler{k}.B"),
            md.Revolute(f"C{k}", f"coupler{k}.C", f"rocker{k}.C"),
            md.Revolute(f"D{k}", f"ground.D{k}", f"rocker{k}.D"),
        ]
        self.said(f"coupler{k}", f"s{k}", 0.6)
        self.said(f"rocker{k}", f"t{k}", 1.5)
        self.ends.append((f"coupler{k}", "P"))

    def slider(self, k):
        """A rod and a slider, its slide sketched."""
        body, point = self.end()
        self.bodies[f"rod{k}"] = {"B": [0, 0], "C": [self.length(f"b{k}", 1.5), 0]}
        self.bodies[f"slider{k}"] = {"C": [0, 0]}
        self.joints += [
            md.Revolute(f"B{k}", f"{body}.{point}", f"rod{k}.B"),
            md.Revolute(f"C{k}", f"rod{k}.C", f"slider{k}.C"),
            md.Prismatic(f"guide{k}", "ground.A", f"slider{k}.C", axis=0.3 * k),
        ]
        self.said(f"guide{k}", f"g{k}", 1.4)
        self.said(f"rod{k}", f"s{k}", 0.2)

    def slot(self, k):
        """A lever with a slot for a pin."""
        body, point = self.end()
        self.ground[f"E{k}"] = [-0.8, self.length(f"e{k}", -0.6)]
        self.bodies[f"lever{k}"] = {"E": [0, 0], "P": [0.7, 0.1]}
        self.joints += [
            md.Revolute(f"E{k}", f"ground.E{k}", f"lever{k}.E"),
            md.PinInSlot(f"slot{k}", f"lever{k}.E", f"{body}.{point}"),
        ]
        self.said(f"slot{k}", f"g{k}", 0.9)
        self.said(f"lever{k}", f"s{k}", 0.5)
        self.ends.append((f"lever{k}", "P"))

    def mechanism(self):
        bodies = [md.Body(name, points=points) for name, points in self.bodies.items()]
        return md.Mechanism(
            parameters=self.parameters, ground=md.Ground(points=self.ground), bodies=bodies,
            joints=self.joints, sketch=self.sketch,
        )  # fmt: skip

    def samples(self):
        """Return values of all parameters by set."""
        found = {}
        for name, value in self.parameters.items():
            if name[0] in "st":
                found[name] = (value + self.rng.uniform(-1, 1, ROWS)).tolist()
            elif name[0] == "g":
                found[name] = self.rng.uniform(-2, 2, ROWS).tolist()
            else:
                found[name] = (value * self.rng.uniform(0.8, 1.2, ROWS)).tolist()
        return found


def compared(seed, most=ROWS):
    """Return (rows, rows computed together, faults) of one study."""
    drawn = Drawn(seed)
    sweep = md.Sweep(md.Driver("crank.angle", from_=1.0, to=1.1), poses=3)
    outputs = [f"bodies/{name}/angle" for name in drawn.bodies]
    samples = {name: values[:most] for name, values in drawn.samples().items()}
    study = md.Study(of="t", samples=samples, outputs=outputs)
    problem = md.Problem(drawn.mechanism(), {"t": sweep, "s": study})
    try:
        result = md.solve(problem, "s")
    except md.MechanismError:  # none of the sketches tells its mode
        return 0, 0, []
    faults = []
    for k in range(len(result.status)):
        chosen = {name: values[k] for name, values in samples.items()}
        try:
            one = md.solve(problem, "t", set=chosen)
            words = [str(word) for word in one.status if word not in ("ok", "limit")]
            status = words[0] if words else "ok"
        except md.MechdaeError:
            one, status = None, "unassembled"
        if result.status[k] != status:
            faults.append(f"{seed}, set {k}: {result.status[k]}, alone {status}")
            continue
        for name in drawn.bodies if one is not None else ():
            row = result.table[f"bodies/{name}/angle"][k]
            gap = np.abs(row - one.bodies[name].angle)
            if np.any(gap > OFF) or np.any(np.isnan(row) != np.isnan(one.bodies[name].angle)):
                faults.append(f"{seed}, set {k}: {name} {np.nanmax(gap):.2g} from the set alone")
                break
    return len(result.status), result.summary["work"]["together"], faults


def main(arguments=None):
    options = attack.parser(__doc__, 2000, "rows").parse_args(arguments)
    rows, together, faults, figures = 0, 0, [], {}
    for seed in itertools.count(options.seed):
        if rows >= options.count:
            break
        own_rows, own_together, own = compared(seed)
        rows, together, faults = rows + own_rows, together + own_together, faults + own
        for text in own:
            print(text, file=sys.stderr, flush=True)
        figures = {"rows": rows, "together": together, "different": len(faults)}
        figures["faults"] = faults
        attack.kept(figures, options.out)
    return attack.ended(figures, options.out, faults)


if __name__ == "__main__":
    sys.exit(main())
