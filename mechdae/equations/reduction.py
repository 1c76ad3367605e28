"""From absolute coordinates to the few unknowns of each Assur group.

Inside a group every variable with a constant pivot (+-1, or a gear ratio, which is never
zero) is eliminated with its row; what is left falls into numerical blocks by a second
block-triangular form. A parameter that may vanish is never a pivot.

No equation of a redundant group is thrown away: its blocks have more equations than
unknowns, and an equation that loses all of its unknowns is kept as a check.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

import casadi as ca

from mechdae.additions import of_cases
from mechdae.describe.coordinates import NamedCoordinate, Selection, selection
from mechdae.describe.mechanism import Mechanism
from mechdae.equations.coordinates import Coordinates
from mechdae.equations.forces.generalised import massive
from mechdae.equations.groups import Group, assur_groups, own_freedom
from mechdae.equations.model import Model, Row, joint_traits
from mechdae.equations.structure_cache import StructureCache, structure_property
from mechdae.errors import MechanismError
from mechdae.records import dataclass
from mechdae.types import Sym

if TYPE_CHECKING:
    from mechdae.equations.tree.joint_chains import WayProducts

SX = ca.SX


@dataclass(frozen=True)
class Block:
    """Equations F = 0 of one numerical block, square in the unknowns ``x`` or redundant.

    ``x`` are positions in the scene's unknown vector, ``uses`` those of earlier blocks
    that F depends on; ``units`` ("m" or "rad"), ``owners`` (joint or driver) and in space
    ``reaches`` (see `Row`) belong to the equations.
    """

    group: int
    x: tuple[int, ...]
    uses: tuple[int, ...]
    residual: Sym
    units: tuple[str, ...]
    owners: tuple[str, ...]
    reaches: tuple[WayProducts | None, ...] = ()

    @property
    def redundant(self) -> bool:
        """More equations than unknowns."""
        return len(self.units) > len(self.x)


@dataclass(frozen=True)
class Check:
    """An equation of a redundant group that holds none of the group's own unknowns."""

    group: int
    residual: Sym
    unit: str
    owner: str
    reach: Any = None


@dataclass
class Scene:
    """What a task needs of a model: driven rows, groups, unknowns, recovered coordinates.

    Attributes
    ----------
    u : SX (nd,)
        Driver values.
    out
        Bodies that constraints are missing for and that nothing asks for: they are in no group.
    x, unknowns : SX (nx,), Coordinates
        Unknowns left after elimination, in solve order.
    blocks : list of Block
    checks : list of Check
        Equations of redundant groups that are left without unknowns.
    recover : dict
        (owner, name) -> expression over (x, u, p) for every coordinate in the scene.
    reaches : dict
        Reaches of expressions that are reported in space, see `told`.
    solved_from : dict
        The equation that gave an eliminated coordinate, by the hash of its symbol.
    """

    model: Model
    drivers: tuple[NamedCoordinate, ...]
    rows: list[Row]
    u: Sym
    all_groups: list[Group]
    groups: list[Group]
    selection: Selection
    out: frozenset[str] = frozenset()
    x: Any = None
    unknowns: Coordinates = field(default_factory=Coordinates)
    blocks: list[Block] = field(default_factory=list)
    checks: list[Check] = field(default_factory=list)
    recover: dict[tuple[str, str], Sym] = field(default_factory=dict)
    cache: StructureCache = field(default_factory=StructureCache)
    reaches: dict[int, tuple[Sym, WayProducts]] = field(default_factory=dict)
    solved_from: dict[int, Row] = field(default_factory=dict)

    def at(self, model: Model) -> Scene:
        """Return the same scene of the model with other numbers."""
        return replace(self, model=model)

    @property
    def x_names(self) -> list[tuple[str, str]]:
        """(owner, name) of the unknowns."""
        return self.unknowns.keys

    @structure_property
    def recovered(self) -> Coordinates:
        """The coordinates in `recover`."""
        coordinates, places = self.model.coordinates, self.model.places
        return Coordinates(coordinates[places[key]] for key in self.recover)

    @structure_property
    def _places(self) -> dict[int, tuple[int, int]]:
        vectors = (self.x, self.u, self.model.p)
        return {
            symbol.element_hash(): (k, i)
            for k, vector in enumerate(vectors)
            for i, symbol in enumerate(vector.elements())
        }

    @structure_property
    def traits(self) -> frozenset[str]:
        """What only some scenes have, as cases are asked about it; see `mechdae.additions`."""
        joints = [self.model.mechanism.joints[name] for g in self.groups for name in g.joints]
        found = {
            "space": self.model.mechanism.dimension == 3,
            "superfluous": bool(self.redundant or self.checks),
        }
        return joint_traits(joints) | {trait for trait, there in found.items() if there}

    def cases(self, question: str) -> list[Any]:
        """Return what cases add under a question, of those whose trait the scene has."""
        return of_cases(question, self.traits) if self.traits else []

    def held(self, expression: Sym) -> tuple[list[int], list[int], list[int]]:
        """Return the positions in x, u and p of the symbols that an expression holds."""
        held: tuple[list[int], list[int], list[int]] = ([], [], [])
        places = self._places
        for symbol in ca.symvar(SX(expression)):
            k, i = places[symbol.element_hash()]
            held[k].append(i)
        for positions in held:
            positions.sort()
        return held

    def keep_reaches(self, values: Sequence[Sym], reaches: Sequence[WayProducts | None]) -> None:
        """Keep the reaches of scalars over (x, u, p)."""
        for value, reach in zip(values, reaches, strict=True):
            if reach is not None and not value.is_constant() and not value.is_leaf():
                self.reaches[value.element_hash()] = (value, reach)

    def reaches_of(self, values: Sym) -> list[WayProducts | None]:
        """Return the reaches of scalars, None of those that are not known."""
        return [self.reaches.get(v.element_hash(), (v, None))[1] for v in values.elements()]

    @property
    def redundant(self) -> list[Group]:
        """The groups with redundant equations."""
        return [group for group in self.groups if group.superfluous]

    def hanging(self, *indices: int) -> set[int]:
        """Return groups and those attached to them, by index."""
        after = set(indices)
        for group in self.groups:
            if after & set(group.after):
                after.add(group.index)
        return after

    @property
    def bodies(self) -> list[str]:
        """The bodies of the groups, in solve order."""
        return [name for group in self.groups for name in group.bodies]

    @property
    def idle(self) -> list[str]:
        """Bodies on one pin or ball that constraints are missing for: they are in no group."""
        held = {name for group in self.all_groups for name in group.bodies}
        mechanism = self.model.mechanism
        if len(held) == len(mechanism.bodies):
            return []
        (rollers,) = of_cases("rollers")
        return [name for name in rollers(mechanism) if name not in held]

    @property
    def left_out(self) -> list[str]:
        """What is to be told of bodies that turn or spin freely."""
        joints = self.model.mechanism.joints.values()
        held = {name: next(j for j in joints if name in j.bodies) for name in self.idle}
        idle = (
            f"{name} turns freely on its {f'{j.kind} joint' if j.freedoms > 1 else 'pin'}: "
            "it is left out"
            for name, j in held.items()
        )
        return [*self.model.left_out, *idle]

    @property
    def not_in_scene(self) -> list[str]:
        """Bodies of groups that no requested output depends on."""
        solved = set(self.bodies)
        return [name for name in self.model.mechanism.bodies if name not in solved]

    def turn_of(self, body: str) -> Sym:
        """Return the angle of a body over (x, u, p), None of one that is not in the scene."""
        return self.recover.get(self.model.q_names[self.model.turn(body)])

    def expression(self, absolute: Sym) -> Sym:
        """Return an expression over q as one over (x, u, p)."""
        return self.model.replaced(absolute, self.recover)


def model_of(
    mechanism: Mechanism, drivers: Sequence[NamedCoordinate] = (), free: Iterable[str] = ()
) -> Model:
    """Return the model of a mechanism with these drivers."""
    return _model("model", mechanism, drivers, free)


def released_model(
    mechanism: Mechanism, named: Iterable[str] = (), free: Iterable[str] = ()
) -> Model:
    """Return the model of a mechanism without drivers, of which these joints are `named`."""
    return _model("released model", mechanism, named, free)


def _model(question: str, mechanism: Mechanism, known: Iterable[Any], free: Iterable[str]) -> Model:
    for make in of_cases(question, {"space"}) if mechanism.dimension == 3 else ():
        found: Model = make(mechanism, known, free)
        return found
    return Model(mechanism, free=free)


def groups_of(
    model: Model, rows: Sequence[Row], coarse: bool = False, out: Collection[str] = ()
) -> list[Group]:
    """Return the Assur groups of a model's rows in solve order; see `assur_groups`.

    Bodies that are `out` are in no group, nor are the equations that hold them.
    """
    found: list[Group] | None = model.groups(rows, coarse, out)
    if found is not None:
        return found
    for without in of_cases("groups") if out else ():
        part: list[Group] = without(model, rows, coarse, out)
        return part
    return assur_groups(model, rows, coarse)


def scene(
    model: Model,
    drivers: Sequence[NamedCoordinate],
    outputs: Sequence[str] | None = None,
    coarse: bool = False,
    loaded: Iterable[str] | None = None,
    sought: Iterable[str] = (),
) -> Scene:
    """Return the scene: only groups that the outputs, the drivers or bodies `sought` depend on.

    With `coarse` all bodies with redundant equations are one group. For a task of forces
    `loaded` are the bodies that forces act on: those of their groups are kept too, and those of
    bodies with a mass.
    """
    rows, u = model.driven(drivers)
    chosen = selection(model.mechanism, outputs, forces=loaded is not None)
    chosen = model.reported(chosen, outputs is not None)
    held = {body for c in drivers for body in c.bodies(model.mechanism)}.union(loaded or (), sought)
    heavy = set() if loaded is None else set(massive(model))
    out = set[str]()
    try:
        groups = groups_of(model, rows, coarse)
    except MechanismError:
        for leave_out in of_cases("left out"):
            chosen, out = leave_out(model, rows, chosen, outputs is not None, held, heavy)
        if not out:
            raise
        groups = groups_of(model, rows, coarse, out)
    remaining = groups if outputs is None else _needed(model, groups, chosen, held | heavy)
    result = Scene(model, tuple(drivers), rows, u, groups, remaining, chosen, frozenset(out))
    reduce(result)
    return result


def _needed(
    model: Model, groups: list[Group], chosen: Selection, loaded: Iterable[str]
) -> list[Group]:
    (bodies_asked_for,) = of_cases("bodies")
    bodies = bodies_asked_for(model, chosen, loaded)
    wanted = {group.index for group in groups if group.driven or bodies & set(group.bodies)}
    front = list(wanted)
    while front:
        for other in groups[front.pop()].after:
            if other not in wanted:
                wanted.add(other)
                front.append(other)
    return [group for group in groups if group.index in wanted]


def reduce(scene: Scene) -> None:
    """Fill in the scene's unknowns, blocks and recovered coordinates."""
    model = scene.model
    nonzero = [
        model.numbers[f"{name}.{entry}"]
        for name, joint in model.mechanism.joints.items()
        for entry in joint.pivots
    ]
    result: list[Sym] = []
    pending: list[tuple[int, list[Sym], list[Equation]]] = []
    for group in scene.groups:
        rows = scene.expression(ca.vertcat(*[scene.rows[i].expression for i in group.rows]))
        equations = [(rows[k], scene.rows[i].unit, str(i)) for k, i in enumerate(group.rows)]
        solved, rest, left = eliminate(equations, [model.q[j] for j in group.columns], nonzero)
        scene.solved_from |= {
            equation[0].element_hash(): scene.rows[int(equation[2])] for equation in solved
        }
        names = {str(model.q[j]): model.q_names[j] for j in group.columns}
        for symbol, expression, *_ in [*solved, *((symbol, symbol) for symbol in left)]:
            scene.recover[names[str(symbol)]] = expression
        rest, without = with_unknowns(rest, left)
        _check_free(group, model, rest, left)
        for row, unit, tag in without:
            if not row.is_zero():
                own_row = scene.rows[int(tag)]
                scene.checks.append(Check(group.index, row, unit, own_row.owner, own_row.reach))
        for unknowns, own in split(rest, left):
            pending.append((group.index, unknowns, own))
            result += unknowns
    scene.x = ca.vertcat(*result) if result else SX(0, 1)
    scene.unknowns = model.coordinates_among(result)
    place = {symbol.element_hash(): i for i, symbol in enumerate(result)}
    start = 0
    for index, unknowns, own in pending:
        x = tuple(range(start, start + len(unknowns)))
        start += len(unknowns)
        residual = ca.vertcat(*[expression for expression, _, _ in own])
        held = [s for s in ca.symvar(SX(residual)) if s.element_hash() in place]
        columns = ca.jacobian(residual, ca.vertcat(*held)).sparsity().get_col()
        used = {place[held[j].element_hash()] for j in columns} - set(x)
        assert all(i < x[0] for i in used), "blocks are not in solve order"
        units = tuple(unit for _, unit, _ in own)
        rows_of = [scene.rows[int(tag)] for _, _, tag in own]
        owners, reaches = (tuple(getattr(r, k) for r in rows_of) for k in ("owner", "reach"))
        uses = tuple(sorted(used))
        scene.blocks.append(Block(index, x, uses, residual, units, owners, reaches))


Equation = tuple[Any, str, str]
"""A residual, its unit and the joint or driver it belongs to."""
Solved = tuple[Any, Any, str]
"""An eliminated symbol, what it is, and the third entry of the equation that gave it."""


def with_unknowns(
    equations: list[Equation], unknowns: list[Sym]
) -> tuple[list[Equation], list[Equation]]:
    """Return the equations that hold an unknown, and those that do not."""
    if not equations:
        return [], []
    rows = ca.vertcat(*[expression for expression, _, _ in equations])
    x = ca.vertcat(*unknowns) if unknowns else SX(0, 1)
    held = set(ca.jacobian(rows, x).sparsity().get_triplet()[0])
    return (
        [equation for i, equation in enumerate(equations) if i in held],
        [equation for i, equation in enumerate(equations) if i not in held],
    )


def _check_free(group: Group, model: Model, rest: list[Equation], left: list[Sym]) -> None:
    """Raise when the equations left cannot fix all unknowns, whatever the dimensions."""
    if not left:
        return
    rows = ca.vertcat(*[expression for expression, _, _ in rest]) if rest else SX(0, 1)
    _, _, colperm, _, _, _, coarse = ca.jacobian(rows, ca.vertcat(*left)).sparsity().btf()
    loose = {str(left[j]) for j in colperm[coarse[2] : coarse[4]]}
    if loose:
        names = [model.q_names[j][0] for j in group.columns if str(model.q[j]) in loose]
        raise own_freedom(group, names)


def eliminate(
    equations: list[Equation], unknowns: list[Sym], nonzero: Sequence[Sym]
) -> tuple[list[Solved], list[Equation], list[Sym]]:
    """Eliminate variables with constant pivots.

    Returns
    -------
    solved : list of Solved
        The expressions hold only symbols that are left (and inputs).
    rest, left
        Equations and unknowns that remain.
    """
    solved: list[Solved] = []
    left, rest = list(unknowns), list(equations)
    while left:
        rows = ca.vertcat(*[expression for expression, _, _ in rest])
        jacobian = ca.jacobian(rows, ca.vertcat(*left))
        pivot = _best_pivot(jacobian, nonzero)
        if pivot is None:
            break
        i, j, value = pivot
        symbol = left.pop(j)
        expression = -ca.substitute(rest[i][0], symbol, 0) / value
        for k in jacobian[:, j].sparsity().row():
            row, unit, owner = rest[k]
            rest[k] = (ca.substitute(row, symbol, expression), unit, owner)
        tag = rest.pop(i)[2]
        solved = [
            (s, ca.substitute(e, symbol, expression) if ca.depends_on(e, symbol) else e, tag)
            for s, e, tag in solved
        ]
        solved.append((symbol, expression, tag))
    return solved, rest, left


def _best_pivot(jacobian: Sym, nonzero: Sequence[Sym]) -> tuple[int, int, Sym] | None:
    """Return row, column and value of the constant pivot in the row with fewest entries."""
    pattern = jacobian.sparsity()
    rows, columns = pattern.get_triplet()
    entries = jacobian.nonzeros()
    in_row = [0] * pattern.size1()
    for i in rows:
        in_row[i] += 1
    best = None
    for i, j, entry in zip(rows, columns, entries, strict=True):
        if entry.is_constant() and float(entry) != 0:
            rank = (in_row[i], abs(float(entry)) != 1, i, j)
        elif any(
            ca.is_equal(entry, ratio, 3) or ca.is_equal(-entry, ratio, 3)
            for ratio in nonzero
            if not ratio.is_constant()
        ):
            rank = (in_row[i], True, i, j)
        else:
            continue
        if best is None or rank < best[0]:
            best = (rank, i, j, entry)
    return best[1:] if best else None


def split(rest: list[Equation], left: list[Sym]) -> list[tuple[list[Sym], list[Equation]]]:
    """Return the blocks (unknowns, equations) of a system in solve order.

    Where equations are redundant, the parts that share them come first: they depend on
    no other unknowns.
    """
    if not left:
        return []
    rows = ca.vertcat(*[expression for expression, _, _ in rest])
    pattern = ca.jacobian(rows, ca.vertcat(*left)).sparsity()
    count, rowperm, colperm, rowblock, colblock, coarse_rows, coarse_cols = pattern.btf()
    parts = [
        (rowperm[rowblock[b] : rowblock[b + 1]], colperm[colblock[b] : colblock[b + 1]])
        for b in range(count)
    ]
    if coarse_rows[1]:
        over, shared = rowperm[: coarse_rows[2]], colperm[: coarse_cols[1]]
        parts = [part for part in parts if not set(part[1]) & set(shared)]
        parts = [*_connected(pattern, over, shared), *parts]
    return [
        ([left[j] for j in sorted(columns)], [rest[i] for i in sorted(rows)])
        for rows, columns in parts
    ]


def _connected(
    pattern: Sym, rows: Sequence[int], columns: Sequence[int]
) -> list[tuple[list[int], list[int]]]:
    """Return rows and columns of the connected parts of a pattern."""
    touched: dict[int, set[int]] = {i: set() for i in rows}
    for i, j in zip(*pattern.get_triplet(), strict=True):
        if i in touched:
            touched[i].add(j)
    left, parts = sorted(columns), []
    while left:
        part, size = {left[0]}, 0
        while len(part) != size:
            size = len(part)
            part = part.union(*[columns for columns in touched.values() if columns & part])
        parts.append(([i for i in rows if touched[i] & part], sorted(part)))
        left = [j for j in left if j not in part]
    return parts
