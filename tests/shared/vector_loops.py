"""Random mechanisms of plane vector loops, their closure, and whether an order can be assembled.

Nothing here asks the package: places of nodes follow from vectors by sums, and what is refused is
looked for by least squares from many starts.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan2, cos, sin

import numpy as np

import mechdae as md


@dataclass
class Loops:
    """Vectors (tail, head) between nodes with places, what is unknown of them, and loops."""

    places: list[np.ndarray]
    ends: dict[str, tuple[int, int]]
    unknown: dict[str, str]
    loops: dict[str, list[str]] = field(default_factory=dict)

    def vector(self, name: str) -> np.ndarray:
        tail, head = self.ends[name]
        return self.places[head] - self.places[tail]

    def angle(self, name: str) -> float:
        return atan2(*self.vector(name)[::-1])

    def length(self, name: str) -> float:
        return float(np.hypot(*self.vector(name)))

    def problem(self) -> md.Problem:
        vectors, sketch = [], {}
        for name, unknown in self.unknown.items():
            given = {"length": self.length(name), "angle": self.angle(name)}
            vectors.append(md.Vector(name, **{k: v for k, v in given.items() if k not in unknown}))
            if "angle" in unknown:
                sketch[name] = self.angle(name)
            if "length" in unknown:
                sketch[f"{name}.length"] = self.length(name)
        at = self.angle("crank")
        turn = md.Sweep(driver=md.Driver("crank.angle", from_=at - 0.02, to=at + 0.02), poses=3)
        return md.Problem(md.from_loops(vectors, self.loops, sketch=sketch), {"turn": turn})


def random_loops(rng: np.random.Generator, count: int) -> Loops:
    """Return a mechanism of so many loops: a driven crank, and dyads with pins or one slide."""
    start = [np.zeros(2), rng.uniform(0.5, 1.5, 2), rng.uniform(-1, 1, 2)]
    net = Loops(start, {"base": (0, 1), "crank": (1, 2)}, {"base": "", "crank": "angle"})
    for k in range(count):
        moving = [n for n in range(len(net.places)) if n > 1]
        p = int(rng.choice(moving))
        slide = rng.random() < 0.4
        q = int(rng.choice([0, 1] if slide else [n for n in range(len(net.places)) if n != p]))
        if any({p, q} == set(ends) for ends in net.ends.values()):
            q = 0  # a dyad on one link would be part of it
        net.places.append(rng.uniform(-2, 2, 2))
        new = len(net.places) - 1
        back = _walk(net, q, p)
        net.ends |= {f"u{k}": (p, new), f"v{k}": (q, new)}
        net.unknown |= {f"u{k}": "angle", f"v{k}": "length" if slide else "angle"}
        net.loops[f"loop{k}"] = [f"u{k}", f"-v{k}", *back]
    return net


def _walk(net: Loops, start: int, end: int) -> list[str]:
    """Return the entries of a shortest walk along vectors from node to node."""
    front, known = [(start, [])], {start}
    while front:
        node, walk = front.pop(0)
        if node == end:
            return walk
        for name, (tail, head) in net.ends.items():
            for here, there, sign in ((tail, head, ""), (head, tail, "-")):
                if here == node and there not in known:
                    known.add(there)
                    front.append((there, [*walk, sign + name]))
    raise AssertionError("nodes hang together")


def nodes_of(names: list[str], loops: dict[str, list[str]]) -> dict[tuple[str, int], int]:
    """Return the node of each end (vector, 0 tail or 1 head); ends that meet are one."""
    number = {(name, end): 2 * k + end for k, name in enumerate(names) for end in (0, 1)}
    for loop in loops.values():
        for one, two in zip(loop, [*loop[1:], loop[0]], strict=True):
            out = (one.lstrip("-"), 0 if one.startswith("-") else 1)
            into = (two.lstrip("-"), 1 if two.startswith("-") else 0)
            old, new = number[out], number[into]
            number = {end: new if value == old else value for end, value in number.items()}
    order = {value: k for k, value in enumerate(dict.fromkeys(number.values()))}
    return {end: order[value] for end, value in number.items()}


def gap(loops: dict[str, list[str]], vectors: dict[str, np.ndarray]) -> float:
    """Return by how much vectors (2,) miss the nodes that their order gives them."""
    nodes, places = nodes_of(list(vectors), loops), {0: np.zeros(2)}
    while len(places) < len(set(nodes.values())):
        for name, vector in vectors.items():
            tail, head = nodes[name, 0], nodes[name, 1]
            if tail in places:
                places.setdefault(head, places[tail] + vector)
            elif head in places:
                places[tail] = places[head] - vector
    return max(
        float(np.abs(places[nodes[name, 1]] - places[nodes[name, 0]] - vector).max())
        for name, vector in vectors.items()
    )


def least_gap(
    loops: dict[str, list[str]],
    unknown: dict[str, str],
    given: dict[str, tuple[float, float]],
    along: dict[str, str],
    rng: np.random.Generator,
    starts: int,
) -> float:
    """Return the least misfit of an order with any angles and lengths of what is unknown.

    ``given`` are length and angle of each vector, from which starts are drawn; ``along`` names the
    vector whose angle it shares.
    """
    names = list(unknown)
    nodes = nodes_of(names, loops)
    count = len(set(nodes.values()))
    turning = [name for name in names if "angle" in unknown[name] and name not in along]
    sliding = [name for name in names if "length" in unknown[name]]
    size = max(length for length, _ in given.values())

    def misfit(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        places = z[: 2 * count].reshape(-1, 2)
        rows, jacobian = [places[0]], np.zeros((2 + 2 * len(names), len(z)))
        jacobian[0, 0] = jacobian[1, 1] = 1.0
        for k, name in enumerate(names):
            a = turning.index(along.get(name, name)) if along.get(name, name) in turning else -1
            angle = z[2 * count + a] if a >= 0 else given[name][1]
            b = sliding.index(name) if name in sliding else -1
            length = z[2 * count + len(turning) + b] if b >= 0 else given[name][0]
            unit, across = np.array([cos(angle), sin(angle)]), np.array([-sin(angle), cos(angle)])
            tail, head = nodes[name, 0], nodes[name, 1]
            rows.append(places[head] - places[tail] - length * unit)
            here = slice(2 + 2 * k, 4 + 2 * k)
            jacobian[here, 2 * head : 2 * head + 2] += np.eye(2)
            jacobian[here, 2 * tail : 2 * tail + 2] -= np.eye(2)
            if a >= 0:
                jacobian[here, 2 * count + a] -= length * across
            if b >= 0:
                jacobian[here, 2 * count + len(turning) + b] -= unit
        return np.concatenate(rows), jacobian

    best = np.inf
    for _ in range(starts):
        z = np.concatenate([
            rng.uniform(-2 * size, 2 * size, 2 * count), rng.uniform(-np.pi, np.pi, len(turning)),
            rng.uniform(-2 * size, 2 * size, len(sliding)),
        ])  # fmt: skip
        damping = 1.0
        f, jacobian = misfit(z)
        for _ in range(150):
            normal = jacobian.T @ jacobian + damping * np.eye(len(z))
            step = -np.linalg.solve(normal, jacobian.T @ f)
            new, slope = misfit(z + step)
            if new @ new < f @ f:
                z, f, jacobian, damping = z + step, new, slope, damping / 5
            else:
                damping *= 4
            if damping > 1e12 or np.abs(step).max() < 1e-14 * size:
                break
        best = min(best, float(np.abs(f).max()))
    return best / size
