"""Random driven groups of three to five links, and a path follower of their own as the truth.

All coordinates of all bodies at once, in doubles: a predictor along the tangent, Newton's method,
steps so short that neither tangents nor the determinant change much. Nothing is eliminated,
nothing is cut into groups, and no code of the package is used.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

FAMILIES = ("pins", "sliders", "gears", "mixed", "short")
SHORT = 1e-3
"""Size of the links with two pins close to each other in the family `short`."""
TURNED, GROWN = 0.03, 0.25
"""Largest change of the unknowns by the change of the tangent over a step, and of log |det|."""
LONGEST, LEAST = 0.02, 1e-11
"""Longest step, and the one at which the path is said to end, in units of the driver."""
FAR = 1000.0
"""Sizes of the mechanism at which a slide has run away."""
SHARED = 0.12
"""Share of joints whose pin lies where another one is."""
POOR = 1e9
"""Condition number above which Newton's method says nothing about a sketch."""


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


@dataclass
class Driven:
    """A mechanism with its exact sketch.

    ``joints`` are (kind, name, first body, first point, second body, second point, keys), body 0
    is the ground; ``start`` (3 n,) holds x, y and angle of the bodies, ``drive`` the joint.
    """

    seed: int
    family: str
    bodies: int
    joints: list = field(default_factory=list)
    start: object = None
    drive: int = 0
    span: tuple = (0.0, 1.0)

    # -- the package's description -----------------------------------------------------------

    @property
    def angular(self):
        return self.joints[self.drive][0] == "revolute"

    @property
    def coordinate(self):
        return f"{self.joints[self.drive][1]}.{'angle' if self.angular else 'slide'}"

    @property
    def s0(self):
        return float(self.driven(self.start)[0])

    def data(self, poses=25, **keys):
        """Return the problem's tables, frames of bodies turned and shifted as they are."""
        bodies = [{} for _ in range(self.bodies + 1)]
        joints, sketch = {}, {}
        for kind, name, a, p, b, q, keys_of in self.joints:
            bodies[a][f"{name}a"], bodies[b][f"{name}b"] = p.tolist(), q.tolist()
            ends = [f"{_name(a)}.{name}a", f"{_name(b)}.{name}b"]
            joints[name] = {"kind": kind, "between": ends, **keys_of}
        for k in range(self.bodies):
            sketch[f"b{k + 1}"] = float(self.start[3 * k + 2])
        for k, (kind, name, *_) in enumerate(self.joints):
            if kind == "prismatic":
                sketch[f"{name}.slide"] = float(self.measured(k, self.start)[0])
        sketch[self.coordinate] = self.s0
        driver = {"coordinate": self.coordinate, "from": self.span[0], "to": self.span[1]}
        return {
            "schema": 1,
            "ground": {"points": bodies[0]},
            "bodies": {f"b{k}": {"points": bodies[k]} for k in range(1, self.bodies + 1)},
            "joints": joints,
            "sketch": sketch,
            "tasks": {"t": {"kind": "sweep", "driver": driver, "poses": poses, **keys}},
        }

    # -- equations -----------------------------------------------------------------------------

    def _frame(self, x, body):
        return np.zeros(3) if body == 0 else x[3 * body - 3 : 3 * body]

    def place(self, x, body, point):
        """Return where a point of a body is, and how it moves with the body's angle."""
        frame = self._frame(x, body)
        arm = turned(frame[2]) @ point
        return frame[:2] + arm, np.array([-arm[1], arm[0]])

    def _row(self, *entries):
        """Return a row of the Jacobian from (body, d/dx, d/dy, d/dangle)."""
        row = np.zeros(3 * self.bodies)
        for body, *slopes in entries:
            if body:
                row[3 * body - 3 : 3 * body] += slopes
        return row

    def measured(self, k, x):
        """Return the coordinate of a revolute or prismatic joint, and its slope."""
        kind, _, a, p, b, q, keys = self.joints[k]
        if kind == "revolute":
            value = self._frame(x, b)[2] - self._frame(x, a)[2]
            return value, self._row((a, 0, 0, -1), (b, 0, 0, 1))
        (one, du), (two, dv) = self.place(x, a, p), self.place(x, b, q)
        angle = self._frame(x, a)[2] + keys["axis"]
        along, across = np.array([np.cos(angle), np.sin(angle)]), None
        across = np.array([-along[1], along[0]])
        gap = two - one
        return along @ gap, self._row(
            (a, *-along, across @ gap - along @ du), (b, *along, along @ dv)
        )

    def driven(self, x):
        return self.measured(self.drive, x)

    def closure(self, x):
        """Return the joints' equations and their Jacobian."""
        values, rows = [], []
        for kind, _, a, p, b, q, keys in self.joints:
            (one, du), (two, dv) = self.place(x, a, p), self.place(x, b, q)
            gap = two - one
            ta, tb = self._frame(x, a)[2], self._frame(x, b)[2]
            if kind == "revolute":
                for i, e in enumerate(np.eye(2)):
                    values.append(gap[i])
                    rows.append(self._row((a, *-e, -du[i]), (b, *e, dv[i])))
            elif kind in ("prismatic", "pin-in-slot"):
                angle = ta + keys["axis"]
                along = np.array([np.cos(angle), np.sin(angle)])
                across = np.array([-along[1], along[0]])
                values.append(across @ gap)
                slope = -along @ gap - across @ du
                rows.append(self._row((a, *-across, slope), (b, *across, across @ dv)))
                if kind == "prismatic":
                    values.append(tb - ta - keys["turn"])
                    rows.append(self._row((a, 0, 0, -1), (b, 0, 0, 1)))
            elif kind == "distance":
                far = float(np.hypot(*gap))
                e = gap / far
                values.append(far - keys["length"])
                rows.append(self._row((a, *-e, -e @ du), (b, *e, e @ dv)))
            else:  # a gear on its carrier
                c, ratio = int(keys["carrier"][1:]) if "carrier" in keys else 0, keys["ratio"]
                tc = self._frame(x, c)[2]
                values.append(ta - tc - ratio * (tb - tc) - keys["phase"])
                row = self._row((a, 0, 0, 1), (b, 0, 0, -ratio), (c, 0, 0, ratio - 1))
                rows.append(row)
        return np.array(values), np.array(rows)

    def system(self, x, s):
        F, J = self.closure(x)
        value, slope = self.driven(x)
        return np.append(F, value - s), np.vstack([J, slope])

    def solved(self, x, s):
        """Return the pose that Newton's method reaches, its Jacobian; None where it does not."""
        moved = np.inf
        for _ in range(12):
            F, J = self.system(x, s)
            try:
                step = np.linalg.solve(J, F)
            except np.linalg.LinAlgError:
                return None
            x = x - step
            before, moved = moved, float(np.max(np.abs(step)))
            if not moved < 1.0:
                return None
            if moved < 1e-14 or (moved < 1e-9 and moved >= before / 2):
                return x, self.system(x, s)[1]
        return None

    # -- the path ------------------------------------------------------------------------------

    def follow(self, x, s, to):
        """Return nodes (s, x) from a pose towards `to`, as far as the path goes."""
        nodes = [(s, x)]
        found = self.solved(x, s)
        if found is None:
            return nodes
        x, J = found
        right = np.append(np.zeros(3 * self.bodies - 1), 1.0)
        tangent, size = np.linalg.solve(J, right), np.linalg.slogdet(J)
        step, way = LONGEST / 4, np.sign(to - s)
        while (rest := way * (to - s)) > 0 and step > LEAST:
            ahead = to if rest <= step * (1 + 1e-9) else s + way * step
            after = self.solved(x + tangent * (ahead - s), ahead)
            if after is None:
                step /= 2
                continue
            turn = np.linalg.solve(after[1], right)
            new = np.linalg.slogdet(after[1])
            bent = float(np.max(np.abs(turn - tangent))) * abs(ahead - s)
            off = float(np.max(np.abs(after[0] - x - (turn + tangent) / 2 * (ahead - s))))
            if new[0] != size[0] or bent + 10 * off > TURNED or abs(new[1] - size[1]) > GROWN:
                step /= 2
                continue
            s, (x, _), tangent, size = ahead, after, turn, new
            nodes.append((s, x))
            if np.max(np.abs(x)) > FAR:
                break
            step = min(1.5 * step, LONGEST)
        return nodes

    def at(self, nodes, s):
        """Return the pose at a place between nodes, None where the path does not reach it."""
        places = np.array([node[0] for node in nodes])
        way = np.sign(places[-1] - places[0]) if len(places) > 1 else 1.0
        k = int(np.searchsorted(way * places, way * s, side="right")) - 1
        if not (k >= 0 and way * s <= way * places[-1]):
            return None
        ahead = self.follow(nodes[k][1], nodes[k][0], s) if s != places[k] else [nodes[k]]
        return ahead[-1][1] if ahead[-1][0] == s else None


def _name(body):
    return f"b{body}" if body else "ground"


# -- drawing -------------------------------------------------------------------------------------


def draw(seed, family=None):
    """Return a random mechanism that moves at its sketch, the same for the same seed."""
    rng = np.random.default_rng([seed, 2024])
    family = family or FAMILIES[seed % len(FAMILIES)]
    while True:
        case = _drawn(rng, seed, family)
        if case is not None:
            return case


def _drawn(rng, seed, family):
    count, full, higher = _numbers(rng, family)
    pairs = _tree(rng, count, full)
    if pairs is None:
        return None
    case = Driven(seed, family, count)
    case.start = np.column_stack(
        [rng.uniform(-1, 1, (count, 2)), rng.uniform(-np.pi, np.pi, count)]
    ).ravel()
    short = int(rng.integers(1, count + 1)) if family == "short" else 0
    slides = {"sliders": 0.35, "mixed": 0.25, "gears": 0.1}.get(family, 0.0)
    kinds = ["prismatic" if rng.random() < slides else "revolute" for _ in pairs]
    near = rng.uniform(-1, 1, 2)
    for k, ((a, b), kind) in enumerate(zip(pairs, kinds, strict=True)):
        if rng.random() < 0.5:
            a, b = b, a
        middle = rng.normal(0, 0.8, 2)
        if case.joints and rng.random() < SHARED:  # a pin that is the pin of another joint too
            other = case.joints[int(rng.integers(len(case.joints)))]
            middle = case.place(case.start, *other[2:4])[0]
        if short in (a, b):  # all pins of one link but the last lie close to each other
            middle = near + SHORT * rng.uniform(-1, 1, 2) * (k % 3 < 2) + (k % 3 == 2)
        _join(case, rng, kind, f"j{k}", a, b, middle)
    for k in range(higher):
        if not _higher(case, rng, family, f"h{k}", pairs, kinds):
            return None
    if any(_zero_length(case, body) for body in range(1, count + 1)):
        return None
    driving = [k for k, joint in enumerate(case.joints) if joint[0] in ("revolute", "prismatic")]
    case.drive = int(rng.choice(driving))
    F, J = case.system(case.start, case.s0)
    if J.shape[0] != J.shape[1] or np.linalg.cond(J) > (POOR if family == "short" else 1e4):
        return None
    assert np.max(np.abs(F)) < 1e-12
    unit = np.pi if case.angular else 1.5
    case.span = tuple(float(case.s0 + unit * part) for part in (-rng.random(), rng.random()))
    return case


def _zero_length(case, body):
    """Return whether two pins of a link are one."""
    joints = [joint for joint in case.joints if joint[0] != "gear"]
    pins = np.array(
        [p for _, _, a, p, *_ in joints if a == body]
        + [q for _, _, _, _, b, q, _ in joints if b == body]
    )
    gaps = np.abs(pins[:, None] - pins[None]).max(axis=2) + np.eye(len(pins))
    return len(pins) < 2 or float(gaps.min()) < 1e-9


def _numbers(rng, family):
    """Return how many bodies, joints of two equations and of one there are."""
    if family in ("pins", "sliders", "short"):
        return (3, 4, 0) if rng.random() < 0.2 else (5, 7, 0)
    choices = [(3, 3, 2), (4, 5, 1), (4, 5, 1), (5, 6, 2), (5, 6, 2)]
    return choices[int(rng.integers(len(choices)))]


def _tree(rng, count, full):
    """Return pairs of bodies that are joined, each pair once, no body left alone."""
    pairs = [(int(rng.integers(0, b)), b) for b in range(1, count + 1)]
    others = [(a, b) for b in range(1, count + 1) for a in range(b) if (a, b) not in pairs]
    if full - count > len(others) or full < count:
        return None
    rng.shuffle(others)
    return pairs + [tuple(map(int, pair)) for pair in others[: full - count]]


def _join(case, rng, kind, name, a, b, middle):
    """Add a joint that is closed at the start; a slide begins away from its end."""

    def local(body, place):
        frame = case._frame(case.start, body)
        return turned(-frame[2]) @ (place - frame[:2])

    keys, ta, tb = {}, case._frame(case.start, a)[2], case._frame(case.start, b)[2]
    other = middle
    if kind in ("prismatic", "pin-in-slot"):
        keys["axis"] = float(rng.uniform(-np.pi, np.pi))
        angle = ta + keys["axis"]
        other = middle + rng.uniform(-1, 1) * np.array([np.cos(angle), np.sin(angle)])
    if kind == "prismatic":
        keys["turn"] = float(tb - ta)
    if kind == "distance":
        keys["length"] = float(rng.uniform(0.3, 1.5))
        angle = rng.uniform(-np.pi, np.pi)
        other = middle + keys["length"] * np.array([np.cos(angle), np.sin(angle)])
    case.joints.append((kind, name, a, local(a, middle), b, local(b, other), keys))


def _higher(case, rng, family, name, pairs, kinds):
    """Add a pair of one equation: a gear between neighbours of one body, a slot, a bar."""
    if family == "mixed" and rng.random() < 0.6:
        a, b = rng.choice(case.bodies + 1, 2, replace=False)
        kind = "pin-in-slot" if rng.random() < 0.6 else "distance"
        _join(case, rng, kind, name, int(a), int(b), rng.uniform(-1.2, 1.2, 2))
        return True
    pins = [pair for pair, kind in zip(pairs, kinds, strict=True) if kind == "revolute"]
    meshes = []
    for c in range(case.bodies + 1):
        wheels = [a + b - c for a, b in pins if c in (a, b) and a + b != c]
        meshes += [(c, a, b) for a in wheels for b in wheels if a != b]
    meshes = [m for m in meshes if 0 not in m[1:]]
    if not meshes:
        return False
    c, a, b = meshes[int(rng.integers(len(meshes)))]
    ratio = float(rng.choice([-3, -2, -1.5, -1, -0.5, 0.5, 2, 3]))
    ta, tb, tc = (case._frame(case.start, body)[2] for body in (a, b, c))
    keys = {"ratio": ratio, "phase": float(ta - tc - ratio * (tb - tc))}
    if c:
        keys["carrier"] = f"b{c}"
    case.joints.append(("gear", name, a, np.zeros(2), b, np.zeros(2), keys))
    return True
