"""Assur groups of a driven mechanism from the block-triangular form of its Jacobian.

(1) Block-triangular form of the absolute Jacobian; (2) a directed graph of blocks and
bodies: a block points to the blocks whose coordinates its rows use, a body and the blocks
of its coordinates point to each other, and so do a curve joint, its own coordinates and its
equations; (3) the strongly connected components are the
Assur groups, in the order in which they are solved from the driver outwards. Class, order
and kind follow Artobolevsky; a higher pair counts as the link and the two lower pairs that
replace it. Where equations are redundant, a case tells which groups have more of them than
coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from mechdae.additions import of_cases
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import Mechanism
from mechdae.equations.mobility import contour_class, missing_constraints, plural
from mechdae.equations.model import Model, Row, square_blocks
from mechdae.errors import FreedomError
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
            over = f" [{self.superfluous} redundant]" if self.superfluous else ""
            return f"{self.kind}({numbers}){over}"
        if self.kind in KINDS:
            return f"II.{KINDS[self.kind]} {self.kind}({numbers})"
        over = f" [{self.superfluous} redundant]" if self.superfluous else ""
        if self.class_ == 1 or self.kind == "weld":
            return f"{'I' if self.class_ == 1 else 'weld'}({numbers}){over}"
        return f"{self.roman} {self.kind}({numbers}){over}"

    @property
    def roman(self) -> str:
        """Its class."""
        return ROMAN[min(self.class_, 10)]

    @property
    def entry(self) -> Json:
        """What results say of it."""
        bodies = list(self.bodies)
        return {"name": self.name, "bodies": bodies, "class": self.roman, "order": self.order}

    @property
    def superfluous(self) -> int:
        """How many of the group's equations are redundant."""
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


def assur_groups(model: Model, rows: Sequence[Row], coarse: bool = False) -> list[Group]:
    """Return the groups in solve order.

    With `coarse` the bodies with redundant equations are one group, but for the driven ones.

    Raises
    ------
    MechanismError
        Constraints are missing by structure; the message names the bodies that can still
        move.
    """
    phi = ca.vertcat(*[row.expression for row in rows])
    pattern = ca.jacobian(phi, model.q).sparsity()
    _, rowperm, colperm, _, _, coarse_rows, coarse_cols = pattern.btf()
    if coarse_cols[4] > coarse_cols[3]:
        raise missing_constraints(model, rows, rowperm, colperm, coarse_rows, coarse_cols)
    count, block_of_row, block_of_column = (
        square_blocks(pattern)
        if not coarse_rows[1]
        else of_cases("blocks")[0](model, rows, pattern, coarse)
    )
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
        ordered = sorted(members[label], key=numbers.__getitem__)
        own_rows, own_columns = rows_of[label], columns_of[label]
        joints = list(dict.fromkeys(rows[i].owner for i in own_rows if not rows[i].driver))
        driven = any(rows[i].driver for i in own_rows)
        over = len(own_rows) > len(own_columns)
        described = _classify(model.mechanism, set(ordered), joints, driven, over)
        groups.append(
            Group(
                index=index[label],
                bodies=tuple(ordered),
                joints=tuple(joints),
                rows=tuple(own_rows),
                columns=tuple(own_columns),
                after=tuple(sorted(index[other] for other in after[label])),
                level=level[label],
                driven=driven,
                numbers=tuple(numbers[name] for name in ordered),
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
    kind = plural(len(bodies), "link")
    contour = contour_class(bodies, joints)
    return {"class_": contour, "order": len(outer), "kind": kind, **common}


def spatial_kind(count: int) -> str:
    """Return the kind of a group of some links in space."""
    return f"{SPATIAL} {plural(count, 'link')}"


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


def formula(groups: Sequence[Group]) -> str:
    """Return the structural formula: ``I(1) -> II.3 RPR(2,3) -> {...; ...}``."""
    levels: dict[int, list[str]] = {}
    for group in groups:
        levels.setdefault(group.level, []).append(group.name)
    parts = [
        names[0] if len(names) == 1 else "{" + "; ".join(names) + "}" for names in levels.values()
    ]
    return " -> ".join(parts)


def own_freedom(group: Group, bodies: Sequence[str], joints: Sequence[str] = ()) -> FreedomError:
    """Return the error for a group whose equations leave bodies free."""
    shared = ", ".join(joints or group.joints)
    return FreedomError(
        f"group {group.name} has a freedom of its own: {', '.join(dict.fromkeys(bodies))} can "
        f"still move, the equations of {shared} depend on each other",
        where="mechanism",
        hint="drive or hold these bodies",
    )
