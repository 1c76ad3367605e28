"""Assur groups of a driven mechanism from the block-triangular form of its Jacobian.

(1) Block-triangular form of the absolute Jacobian; (2) a directed graph of blocks and
bodies: a block points to the blocks whose coordinates its rows use, a body and the blocks
of its coordinates point to each other, and so do a curve joint, its own coordinates and its
equations; (3) the strongly connected components are the
Assur groups, in the order in which they are solved from the driver outwards. Class, order
and kind follow Artobolevsky; a higher pair counts as the link and the two lower pairs that
replace it. Where equations are superfluous, `mechdae.equations.redundant_constraints` tells which
groups have more of them than coordinates.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from dataclasses import replace

import casadi as ca

from mechdae.describe.coordinates import coordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.spinning_links import idle_links
from mechdae.describe.table import Table
from mechdae.equations.model import Model, Row
from mechdae.equations.redundant_constraints import redundant_blocks, square_blocks
from mechdae.equations.space import PLANE
from mechdae.errors import MechanismError
from mechdae.records import dataclass
from mechdae.types import Integers, Json

ROMAN = ("0", "I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX", "X")
SPATIAL = "spatial"
"""Begins the kind of a group in space, which has no class of Artobolevsky's."""
KINDS = {"RRR": 1, "RRP": 2, "RPR": 3, "PRP": 4, "RPP": 5}


@dataclass(frozen=True)
class Group:
    """One Assur group (or the driven link) and its share of rows and columns.

    ``kind`` is the sequence of pairs of a dyad (``RPR``), "driver", "weld" or the number of
    links and pairs; ``after`` are indices of the groups it is attached to. ``superfluous``
    is the number of equations above that of coordinates: a redundant group, which moves by
    its special dimensions only.
    """

    index: int
    bodies: tuple[str, ...]
    joints: tuple[str, ...]
    inner: tuple[str, ...]
    rows: tuple[int, ...]
    columns: tuple[int, ...]
    after: tuple[int, ...]
    level: int
    driven: bool
    class_: int
    order: int
    kind: str
    higher_pairs: int
    numbers: tuple[int, ...]

    @property
    def is_dyad(self) -> bool:
        """Two links and three pairs, one of them inner."""
        return self.class_ == 2 and self.kind in KINDS

    @property
    def name(self) -> str:
        """Name in the structural formula: ``II.3 RPR(2,3)``; redundant groups say so."""
        numbers = ",".join(map(str, self.numbers))
        if self.kind.startswith(SPATIAL):
            over = f" [{self.superfluous} superfluous]" if self.superfluous else ""
            return f"{self.kind}({numbers}){over}"
        if self.kind in KINDS:
            return f"II.{KINDS[self.kind]} {self.kind}({numbers})"
        over = f" [{self.superfluous} superfluous]" if self.superfluous else ""
        if self.kind in ("driver", "weld"):
            return f"{'I' if self.kind == 'driver' else 'weld'}({numbers}){over}"
        return f"{ROMAN[min(self.class_, 10)]} {self.kind}({numbers}){over}"

    @property
    def superfluous(self) -> int:
        """How many of the group's equations are superfluous."""
        return len(self.rows) - len(self.columns)

    @property
    def key_joint(self) -> str:
        """The joint that opens when the group cannot be assembled, empty where it has none."""
        return next(iter(self.inner or self.joints), "")


def body_numbers(mechanism: Mechanism) -> dict[str, int]:
    """Return the number of each body: its own, else its place in the file."""
    return {
        name: body.number if body.number is not None else position
        for position, (name, body) in enumerate(mechanism.bodies.items(), start=1)
    }


def loose_bodies(model: Model, rows: Sequence[Row]) -> list[str]:
    """Return the bodies that constraints are missing for, by structure."""
    pattern = ca.jacobian(ca.vertcat(*[row.expression for row in rows]), model.q).sparsity()
    _, _, columns, _, _, _, coarse = pattern.btf()
    return list(dict.fromkeys(model.q_names[j][0] for j in columns[coarse[2] : coarse[4]]))


def assur_groups(
    model: Model, rows: Sequence[Row], coarse: bool = False, out: Collection[str] = ()
) -> list[Group]:
    """Return the groups in solve order.

    With `coarse` the bodies with superfluous equations are one group, but for the driven ones.
    Bodies that are `out` are in no group, nor are the equations that hold them.

    Raises
    ------
    MechanismError
        Constraints are missing by structure; the message names the bodies that can still
        move.
    """
    if out:
        return _without(model, rows, coarse, out)
    phi = ca.vertcat(*[row.expression for row in rows])
    pattern = ca.jacobian(phi, model.q).sparsity()
    _, rowperm, colperm, _, _, coarse_rows, coarse_cols = pattern.btf()
    _check_missing(model, rows, rowperm, colperm, coarse_rows, coarse_cols)
    if coarse_rows[1]:
        count, block_of_row, block_of_column = redundant_blocks(model, rows, pattern, coarse)
    else:
        count, block_of_row, block_of_column = square_blocks(pattern)
    bodies = list(model.mechanism.bodies)
    place = {name: count + i for i, name in enumerate([*bodies, *model.contacts])}
    arrows: set[tuple[int, int]] = set()
    for i, j in zip(*pattern.get_triplet(), strict=True):
        arrows.add((int(block_of_row[i]), int(block_of_column[j])))
    for j, (name, _) in enumerate(model.q_names):
        arrows |= {(place[name], int(block_of_column[j])), (int(block_of_column[j]), place[name])}
    for i, row in enumerate(rows):
        if row.owner in model.contacts:
            block = int(block_of_row[i])
            arrows |= {(place[row.owner], block), (block, place[row.owner])}
    component = _components(count + len(place), arrows)
    members: dict[int, list[str]] = {}
    for name in bodies:
        members.setdefault(component[place[name]], []).append(name)
    after: dict[int, set[int]] = {label: set() for label in members}
    for i, j in arrows:
        if component[i] != component[j]:
            after[component[i]].add(component[j])
    return _ordered(model, rows, block_of_row, block_of_column, component, members, after)


def _without(model: Model, rows: Sequence[Row], coarse: bool, out: Collection[str]) -> list[Group]:
    """Return the groups of a mechanism without some bodies: numbers are those of the whole."""
    mechanism = model.mechanism
    if {*mechanism.bodies} <= {*out}:
        return []
    gone = {name for name, joint in mechanism.joints.items() if set(out) & set(joint.bodies)}
    rest = replace(
        mechanism,
        bodies=Table({n: body for n, body in mechanism.bodies.items() if n not in out}),
        joints=Table({n: joint for n, joint in mechanism.joints.items() if n not in gone}),
        loads=Table(),
        outputs=Table(),
        sketch=Table(),
    )
    kept = [i for i, row in enumerate(rows) if row.owner not in gone]
    drivers = [coordinate(rest, rows[i].owner) for i in kept if rows[i].driver]
    part = model.part(rest)
    own_rows, _ = part.driven(drivers)
    numbers, columns = body_numbers(mechanism), [model.places[key] for key in part.q_names]
    return [
        replace(
            group,
            rows=tuple(kept[i] for i in group.rows),
            columns=tuple(columns[j] for j in group.columns),
            numbers=tuple(numbers[name] for name in group.bodies),
        )
        for group in assur_groups(part, own_rows, coarse)
    ]


def _components(size: int, arrows: set[tuple[int, int]]) -> list[int]:
    """Return the label of the strongly connected component of each node."""
    pairs = sorted(arrows | {(i, i) for i in range(size)})
    graph = ca.Sparsity.triplet(size, size, [i for i, _ in pairs], [j for _, j in pairs])
    count, order, start = graph.scc()
    labels = [0] * size
    for label in range(count):
        for node in order[start[label] : start[label + 1]]:
            labels[node] = label
    return labels


def _ordered(
    model: Model,
    rows: Sequence[Row],
    block_of_row: Integers,
    block_of_column: Integers,
    component: list[int],
    members: dict[int, list[str]],
    after: dict[int, set[int]],
) -> list[Group]:
    numbers = body_numbers(model.mechanism)
    level: dict[int, int] = {}

    def depth(label: int) -> int:
        stack = [label]
        while stack:
            top = stack[-1]
            missing = [other for other in after[top] if other not in level]
            if missing:
                stack += missing
            else:
                level[top] = 1 + max((level[other] for other in after[top]), default=-1)
                stack.pop()
        return level[label]

    labels = sorted(members, key=lambda c: (depth(c), min(numbers[b] for b in members[c])))
    index = {label: position for position, label in enumerate(labels)}
    rows_of: dict[int, list[int]] = {label: [] for label in labels}
    columns_of: dict[int, list[int]] = {label: [] for label in labels}
    for i, block in enumerate(block_of_row):
        rows_of[component[block]].append(i)
    for j, block in enumerate(block_of_column):
        columns_of[component[block]].append(j)
    groups = []
    for label in labels:
        own = sorted(members[label], key=numbers.__getitem__)
        own_rows, own_columns = rows_of[label], columns_of[label]
        joints = list(dict.fromkeys(rows[i].owner for i in own_rows if not rows[i].driver))
        driven = any(rows[i].driver for i in own_rows)
        over = len(own_rows) > len(own_columns)
        described = _classify(model.mechanism, set(own), joints, driven, over)
        groups.append(
            Group(
                index=index[label],
                bodies=tuple(own),
                joints=tuple(joints),
                rows=tuple(own_rows),
                columns=tuple(own_columns),
                after=tuple(sorted(index[other] for other in after[label])),
                level=level[label],
                driven=driven,
                numbers=tuple(numbers[name] for name in own),
                **described,
            )
        )
    return groups


def _classify(
    mechanism: Mechanism, bodies: set[str], names: Sequence[str], driven: bool, over: bool
) -> Json:
    """Return class, order, kind, inner joints and count of higher pairs of a group."""
    joints = [mechanism.joints[name] for name in names]
    inner = [j for j in joints if {j.first_body, j.second_body} <= bodies]
    outer = [j for j in joints if j not in inner]
    higher = sum(not j.lower for j in joints)
    common = {"inner": tuple(j.name for j in inner), "higher_pairs": higher}
    if driven:
        kind = "driver" if len(bodies) == 1 else f"driven {len(bodies)} links"
        return {"class_": 1, "order": len(outer), "kind": kind, **common}
    if mechanism.dimension == 3:
        return {"class_": 0, "order": len(outer), "kind": spatial_kind(len(bodies)), **common}
    if [j.rigid for j in joints] == [True]:
        return {"class_": 0, "order": 1, "kind": "weld", **common}
    if len(bodies) + higher == 2 and not over:
        kind = _dyad_kind(bodies, inner, outer)
        return {"class_": 2, "order": 2, "kind": kind, **common}
    if all(j.wheels == 2 or j.hinge for j in joints) and len(bodies) == higher:
        # wheels on fixed or known centres: each closed by its own mesh
        return {"class_": 2, "order": len(outer), "kind": "gears", **common}
    kind = _plural(len(bodies), "link")
    contour = _contour(bodies, joints)
    return {"class_": contour, "order": len(outer), "kind": kind, **common}


def spatial_kind(count: int) -> str:
    """Return the kind of a group of some links in space."""
    return f"{SPATIAL} {_plural(count, 'link')}"


def _dyad_kind(bodies: set[str], inner: list[Joint], outer: list[Joint]) -> str:
    if len(bodies) == 2:
        letters = [j.letter for j in (outer[0], inner[0], outer[1])] if len(outer) == 2 else []
    else:
        lower = [j.letter for j in outer if j.lower]
        higher = next(j for j in outer if not j.lower)
        if higher.dyad:
            return higher.dyad
        inside = higher.first_body in bodies
        letters = [*lower, *(higher.replaced if inside else higher.replaced[::-1])]
    sequence = "".join(letters)
    for candidate in (sequence, sequence[::-1]):
        if candidate in KINDS:
            return candidate
    return "gear" if not sequence or len(sequence) == 1 else sequence


def _contour(bodies: set[str], joints: list[Joint]) -> int:
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


def formula(groups: Sequence[Group]) -> str:
    """Return the structural formula: ``I(1) -> II.3 RPR(2,3) -> {...; ...}``."""
    levels: dict[int, list[str]] = {}
    for group in groups:
        levels.setdefault(group.level, []).append(group.name)
    parts = [
        names[0] if len(names) == 1 else "{" + "; ".join(names) + "}" for names in levels.values()
    ]
    return " -> ".join(parts)


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
    from mechdae.describe.spinning_links import points_of, spins

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


def _check_missing(
    model: Model,
    rows: Sequence[Row],
    rowperm: Sequence[int],
    colperm: Sequence[int],
    coarse_rows: Sequence[int],
    coarse_cols: Sequence[int],
) -> None:
    """Raise when the structure leaves bodies free."""
    # casadi keeps the parts of the transposed pattern: unmatched rows first, columns last
    loose = colperm[coarse_cols[2] : coarse_cols[4]]
    over = rowperm[coarse_rows[0] : coarse_rows[2]]
    missing = coarse_cols[4] - coarse_cols[3]
    extra = coarse_rows[1] - coarse_rows[0]
    if not missing:
        return
    free = list(dict.fromkeys(model.q_names[j][0] for j in loose))
    parts = [f"{_plural(missing, 'constraint')} missing: {_list(free)} can still move"]
    if extra:
        owners = list(dict.fromkeys(rows[i].owner for i in over))
        parts.append(f"{_plural(extra, 'constraint')} superfluous among {_list(owners)}")
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
        f"{formula} = {count['W']} freedom(s), "
        f"{_plural(drivers, 'driver')}; add a driver or a joint"
    )
    raise MechanismError("; ".join(parts), where="mechanism", hint=hint)


def _plural(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"


def _list(names: Sequence[str], most: int = 8) -> str:
    rest = len(names) - most
    return ", ".join(names[:most]) + (f" and {rest} more" if rest > 0 else "")


__all__ = ["GROUND", "Group", "assur_groups", "body_numbers", "count_mobility", "formula"]
