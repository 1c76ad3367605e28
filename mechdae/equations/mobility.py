"""What counts of links and pairs say: freedoms, constraints that are missing, classes of groups."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import Mechanism
from mechdae.equations.model import Model, Row
from mechdae.equations.space import PLANE
from mechdae.errors import MechanismError
from mechdae.types import Json


def count_mobility(mechanism: Mechanism) -> Json:
    """Return n, p5, p4 and W = 3 n - 2 p5 - p4 (Chebyshev); a weld joins two links to one.

    In space n, p5 to p1, W = 6 n - 5 p5 - ... - p1 and the ``idle`` links.
    """
    joints = list(mechanism.joints.values())
    if mechanism.dimension == 3:
        return _count_in_space(mechanism)
    n = len(mechanism.bodies) - sum(j.rigid for j in joints)
    p5 = sum(j.lower and not j.rigid for j in joints)
    p4 = sum(not j.lower for j in joints)
    return {"n": n, "p5": p5, "p4": p4, "W": PLANE.mobility(n, p5, p4)}


def _count_in_space(mechanism: Mechanism) -> Json:
    """Return n, the pairs p5 to p1 by the freedoms they take, and W = 6 n - 5 p5 - ... - p1."""
    from mechdae.describe.spinning_links import idle_links, points_of, spins

    joints = list(mechanism.joints.values())
    n = len(mechanism.bodies) - sum(j.rigid for j in joints)
    points = points_of(mechanism)  # at the ends of vectors: they do not turn
    taken = [
        3 - j.freedoms if j.pointer else 6 - j.freedoms if j.spatial else 1
        for j in joints
        if not j.rigid
    ]
    if points and len(points) == n:
        return {"n": n, "p": sum(taken), "W": 3 * n - sum(taken)}
    pairs = {f"p{k}": taken.count(k) for k in (5, 4, 3, 2, 1)}
    idle = [*idle_links(mechanism), *(" + ".join(spin.bodies) for spin in spins(mechanism))]
    if not points:
        return {"n": n, **pairs, "W": 6 * n - sum(taken), "idle": idle}
    bodies = n - len(points)
    W = 6 * bodies + 3 * len(points) - sum(taken)
    return {"n": bodies, "points": len(points), **pairs, "W": W, "idle": idle}


def missing_constraints(
    model: Model,
    rows: Sequence[Row],
    rowperm: Sequence[int],
    colperm: Sequence[int],
    coarse_rows: Sequence[int],
    coarse_cols: Sequence[int],
) -> MechanismError:
    """Return the error for a structure that leaves bodies free."""
    # casadi keeps the parts of the transposed pattern: unmatched rows first, columns last
    loose = colperm[coarse_cols[2] : coarse_cols[4]]
    over = rowperm[coarse_rows[0] : coarse_rows[2]]
    missing = coarse_cols[4] - coarse_cols[3]
    extra = coarse_rows[1] - coarse_rows[0]
    free = list(dict.fromkeys(model.q_names[j][0] for j in loose))
    parts = [f"{plural(missing, 'constraint')} missing: {_list(free)} can still move"]
    if extra:
        owners = list(dict.fromkeys(rows[i].owner for i in over))
        parts.append(f"{plural(extra, 'constraint')} redundant among {_list(owners)}")
    count = count_mobility(model.mechanism)
    drivers = sum(row.driver for row in rows)
    terms = [f"{k}*{count[f'p{k}']}" for k in (5, 4, 3, 2, 1) if count.get(f"p{k}")]
    if model.mechanism.dimension == 2:
        formula = f"3*{count['n']} - 2*{count['p5']} - {count['p4']}"
    elif "p" in count:
        formula = f"3*{count['n']} - {count['p']}"
    else:
        moved = f"6*{count['n']}" + (f" + 3*{count['points']}" if "points" in count else "")
        formula = " - ".join([moved, *terms])
    hint = (
        f"{formula} = {count['W']} freedom(s), {plural(drivers, 'driver')}; add a driver or a joint"
    )
    return MechanismError("; ".join(parts), where="mechanism", hint=hint)


def plural(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"


def _list(names: Sequence[str], most: int = 8) -> str:
    rest = len(names) - most
    return ", ".join(names[:most]) + (f" and {rest} more" if rest > 0 else "")


def contour_class(bodies: set[str], joints: list[Joint]) -> int:
    """Return the class: pairs in the largest contour, rigid or mutable, of inner pairs.

    The link that replaces a higher pair belongs to the group.
    """
    neighbours: dict[str, set[str]] = {name: set() for name in bodies}
    pairs = dict.fromkeys(bodies, 0)
    for joint in joints:
        ends = [b for b in (joint.first_body, joint.second_body) if b in bodies]
        ends = ends or [b for b in joint.bodies if b in bodies]  # a gear holds its carrier alone
        path = ends if joint.lower else [ends[0], f"link of {joint.name}", *ends[1:]]
        for a, b in itertools.pairwise(path):
            for one, other in ((a, b), (b, a)):
                neighbours.setdefault(one, set()).add(other)
                pairs[one] = pairs.get(one, 0) + 1
    rigid = max((count for count in pairs.values() if count >= 3), default=2)
    return max(rigid, _shortest_cycles(neighbours))


def _shortest_cycles(neighbours: dict[str, set[str]]) -> int:
    """Return the longest of the shortest cycles through each edge; 0 for a tree."""
    longest = 0
    for a in neighbours:
        for b in neighbours[a]:
            distance, front = {a: 0}, [a]
            while front and b not in distance:
                ahead = []
                for node in front:
                    for other in neighbours[node]:
                        if other not in distance and {node, other} != {a, b}:
                            distance[other] = distance[node] + 1
                            ahead.append(other)
                front = ahead
            if b in distance:
                longest = max(longest, distance[b] + 1)
    return longest
