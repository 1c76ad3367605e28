"""Every loop and every recursion of the package ends: by its shape, or by what is written here.

Shapes are read off the syntax: a collection that only shrinks, places that are visited once, a
count that is compared, a name that is lengthened until it is free. The others are in the tables,
with what bounds them and, where a search may give up, with what is said then;
`tests/assembly/test_bounded_work.py` runs into such bounds.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import mechdae

ROOT = Path(mechdae.__file__).parent

ENDLESS = {
    ("motion/assembly/multistart.py", "__call__"): (
        "starts double up to `most`", "the count is that of the solutions found"
    ),
    ("motion/cases/space/spatial_group.py", "__init__"): (
        "a joint is taken each time", "OtherShape"
    ),
    ("motion/cases/meshes/turn_lattice.py", "_cleared"): (
        "Euclid's algorithm: entries get smaller", "rows exchanged"
    ),
    ("parts/types/chains/variants/orders.py", "_walk"): (
        "a loop comes back to the ground", "the walk"
    ),
    ("motion/continuation/follower.py", "extend"): (
        "`MOST_STEPS` ahead, `MOST_SMALL_STEPS` where proofs are weak", "InputError, `unproved`"
    ),
    ("motion/continuation/follower.py", "_stride"): ("`count` steps", "how many were proved"),
    ("motion/continuation/follower.py", "_careful"): (
        "the step is halved down to `SMALLEST`", "a limit, `pole` or `unproved`"
    ),
    ("motion/cases/hard_steps/fold_approach.py", "lead"): ("`STEPS` on the curve",
        "no way into the fold"),
    ("motion/cases/hard_steps/obstacles.py", "_approach"): (
        "what is left shrinks by 1e-3 of itself at least, down to `APPROACH`", "the limit, or not"
    ),
    ("motion/cases/hard_steps/obstacles.py", "_in_shares"): (
        "so many steps as lead to `APPROACH`", "the share to go on with"
    ),
    ("describe/vectors/in_space.py", "_fixed"): ("a vector is taken away each time", "places"),
    ("dynamics/time_rates.py", "stretch"): ("each look reaches further, up to the end",
        "a stretch"),
    ("parts/exchange/robots/link_tree.py", "_chosen"): (
        "a body is reached each time", "the joints"
    ),
    ("numerics/homotopy/stored_instances.py", "refined"): (
        "there are more colours each time", "the colours"
    ),
    ("numerics/homotopy/generic_count.py", "count"): ("subsets are counted down", "the count"),
    ("motion/kinematics/near_poses.py", "_expressions"): (
        "a parameter is taken each time", "pairs"
    ),
    ("parts/types/schemes/certified_pareto.py", "front_of"): ("an entry is judged each time",
        "the front"),
    ("design/synthesis/exact/complete.py", "generic"): (
        "`TRIPS` trips, `WORK` paths", "basis `none`"
    ),
}  # fmt: skip
"""By module and function: what bounds `while True`, and what is said where the bound is met."""

CALL, DEFINED = re.compile(r"\b(\w+)\("), re.compile(r"\bdef (\w+)\(")

LOOPS = {
    ("describe/file/units.py", "written_units"): "each part of a file is taken away once",
    # each turn takes something away, or places what was not placed
    ("motion/cases/meshes/turn_lattice.py", "_shortened"): "a vector gets shorter",
    ("parts/types/chains/labelling.py", "_refined"): "there are more colours each time",
    ("motion/cases/hard_steps/obstacles.py", "go_back"): "a node is taken away each time",
    ("describe/expression.py", "dotted"): "a node's parent in a syntax tree",
    ("design/derivatives/function.py", "_plain"): "two signs become one",
    ("draw/diagram/heads.py", "fitted"): "the text gets shorter",
    ("draw/smooth.py", "thinned"): "there are fewer rows each time",
    ("draw/diagram/scene.py", "read_scene"): "a body is placed each time",
    ("draw/space/spatial_scene.py", "pose_chains"): "a body with two joints each time, none twice",
    ("draw/space/spatial_scene.py", "read_spatial"): "a body is placed each time",
    ("dynamics/task.py", "_cut"): "rows are taken away until one is left",
    ("parts/exchange/assemblies/asmt_read.py", "_rounded"): "nodes of a tree",
    ("parts/exchange/assemblies/asmt_read.py", "joined"): "more parts are fixed each time",
    ("parts/exchange/robots/link_tree.py", "_small"): "bodies are reached once",
    ("parts/exchange/robots/arm_of_urdf.py", "_way"): "a joint is met once, or it is an error",
    ("tasks/export/folder.py", "digest"): "the end of the file",
    ("numerics/homotopy/generic_count.py", "walk"): "fewer steps are left each time, or an error",
    ("numerics/homotopy/generic_count.py", "connected"): "subsets are counted down",
    ("kernels/bounds/series.py", "inverse"): "the series is twice as long each time",
    ("kernels/machine/program.py", "stored"): "found further on in the text each time",
    ("equations/mobility.py", "_shortest_cycles"): "bodies are reached once",
    ("equations/reduction.py", "_connected"): "the part gets larger",
    ("equations/cases/redundant_constraints.py", "_spreading"): "the neighbourhood gets larger",
    ("equations/cases/redundant_constraints.py", "_with_alternatives"): (
        "the set gets larger, or shorter"
    ),
    ("equations/tree/tree_model.py", "to_root"): "a body's parent in a tree",
    ("parts/types/schemes/certified_pareto.py", "_chosen"): "a point is chosen each time",
    ("design/synthesis/exact/conditions.py", "drawn"): "a place is drawn each time",
    ("tasks/vector_modules.py", "_root"): "what a vector runs along is no circle, or is refused",
    ("motion/cases/space/three_points.py", "_chain"): "joints on a way, or OtherShape",
    # intervals that are halved down to rounding or to a width with a name
    ("motion/cases/curves/undercut.py", "refined"): "cut into `WITHIN` parts, down to `least`",
    ("motion/cases/laws/laws.py", "_corners"): "the interval is halved down to rounding",
    ("motion/cases/laws/laws.py", "_refuse_cuts"): "the interval is halved down to rounding",
    ("motion/cases/laws/laws.py", "_refuse_jumps"): "halved down to `ROUNDING`: InputError",
    ("dynamics/time_rates.py",
        "_cells"): "halved down to `NARROW`, `BUDGET` at once: a shorter stretch",
    # steps along a way: none is shorter than a share of it
    ("motion/cases/hard_steps/obstacles.py", "walk"): "a step of 1e-3 of what is left: not reached",
    ("design/derivatives/function.py", "_along"): "`HALVINGS` of the step: no number",
    ("dynamics/bdf.py", "_step_impl"): "`LEAST` of the time, `STEPS` steps: S7",
    ("dynamics/integrate.py", "_step_impl"): "`LEAST` of the time, `STEPS` steps: S7",
    ("dynamics/rest/all_equilibria.py", "_walked"): "steps of 0.1 of the way",
    ("dynamics/run.py", "integrate"): "`CROWD` turns in an instant, `STEPS` steps: S5, S7",
    ("dynamics/start.py", "_way"): "a step of 1e-4 of the way: a contradiction",
    ("parts/exchange/robots/mimic.py", "_stretches"): "`LEAST` of the path's steps: NotProved",
    ("motion/kinematics/near_poses.py", "_nodes"): "`most` steps, `SMALLEST` of the largest: None",
    ("numerics/radau.py", "steps"): "1e-13 of the time: ArithmeticError",
    ("design/studies/batches/march.py", "run"): "`MOST` steps of a lane, `SMALLEST`: done alone",
    ("parts/proof/checker/counts_on_curves.py", "count"): "halved to `SHORTEST_PART`: FalseClaim",
    ("parts/proof/checker/superfluous.py", "parts_of_full_rank"): "`least` of the way: FalseClaim",
    ("parts/proof/checker/tubes.py", "_prove"): "a term each time",
    ("parts/proof/checker/tubes.py", "follow"): "`least` of the way: ArithmeticError",
    ("motion/assembly/not_assembled.py", "where_it_closes"): "halved down to `CLOSE`",
    # searches over many cases
    ("additions.py", "__iter__"): "a name is listed each time",
    ("parts/proof/checker/boxes.py", "look"): "`MOST_BOXES`: FalseClaim",
    ("motion/assembly/mode_tree.py", "_later"): "`MOST_SOLVED` groups, `DEEPEST`: UnavailableError",
    ("motion/assembly/mode_tree.py", "having"): "modes of the tree, one by one",
    ("motion/assembly/no_others.py", "looked_at"): "`most` boxes: not proved",
    ("design/jobs/distribute.py", "distribute"): "a job is lost `ATTEMPTS` times: SolveError",
    ("design/jobs/distribute.py", "go"): "jobs are done once",
    ("describe/file/load.py", "_repeats"): "tables of a tree, `MAX_DEPTH` deep: InputError",
    ("describe/file/sections.py", "used_names"): "tables of a tree, looked at before for depth",
}  # fmt: skip
"""By module and function: what ends a `while` of no such shape, what is said then."""

RECURSIONS = {
    ("parts/exchange/workshop/bodies.py", "_hold"): "a body is held once",
    ("describe/file/schema.py", "enter"): "a schema is entered before its parts",
    ("motion/assembly/mode_tree.py", "_later"): "fewer groups are left each time, `DEEPEST`",
    ("parts/types/chains/labelling.py", "_leaves"): "more colours each time",
    ("motion/assembly/no_others.py", "_inverses"): "a square matrix the second time",
    ("describe/layers.py", "_next"): "a link is laid each time, `TRIED`: said",
    ("parts/types/schemes/types.py", "_followed"): "a point is placed each time",
    ("parts/types/chains/chains.py", "_ascending"): "the count falls",
    ("parts/types/chains/chains.py", "spread"): "the place rises",
    ("describe/values.py", "sequence"): "an array becomes a list",
    ("describe/values.py", "evaluated"): "items of a tuple",
    ("draw/graphs/map.py", "_levels"): "the second call is with False",
    ("dynamics/output_values.py", "over_states"): "named expressions without circles",
    ("forces/task.py", "with_forces"): "tasks inside of tasks",
    ("numerics/homotopy/stored_instances.py", "least"): "more colours each time",
    ("numerics/homotopy/generic_count.py", "grown"): "the place rises",
    ("design/jobs/log.py", "_differences"): "values inside of values",
    ("describe/expression_units.py", "inferred"): "once more, exact uses alone",
    ("describe/series_units.py", "path_unit"): "a path gets shorter",
    ("parts/page/link.py", "put"): "modules without circles",
    ("tasks/dispatch/solve.py", "available"): "tasks inside of tasks",
}
"""Functions that call themselves, otherwise than with parts of what they were given."""


@cache
def found() -> tuple[list[tuple[str, str, ast.While]], list[tuple[str, ast.FunctionDef, bool]]]:
    """Return the `while` loops of the package by module and innermost function, and functions.

    Of functions with their modules, whether they are methods; none that are not named again.
    """
    loops, functions = list[tuple[str, str, ast.While]](), list[tuple[str, ast.FunctionDef, bool]]()
    for path in ROOT.rglob("*.py"):
        text, module = path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix()
        words = Counter(CALL.findall(text))
        again = {name for name in DEFINED.findall(text) if words[name] > 1}
        if not again and "while " not in text:
            continue
        todo: list[tuple[ast.AST, str, bool]] = [(ast.parse(text), "", False)]
        while todo:
            node, name, method = todo.pop()
            if isinstance(node, ast.FunctionDef):
                name = node.name
                if name in again:
                    functions.append((module, node, method))
            if isinstance(node, ast.While):
                loops.append((module, name, node))
            inside = isinstance(node, ast.ClassDef)
            todo += [
                (child, name, inside)
                for child in ast.iter_child_nodes(node)
                if not isinstance(child, ast.expr)
            ]
    return loops, functions


def endless() -> set[tuple[str, str]]:
    """Return the innermost functions with a loop whose condition is always true."""
    return {(m, name) for m, name, loop in found()[0] if isinstance(loop.test, ast.Constant)}


# -- shapes of loops that end ----------------------------------------------------------------------

SHRINKING = ("pop", "popleft", "popitem", "remove", "discard", "heappop")
GROWING = ("append", "extend", "insert", "update", "add", "heappush")


def named(node: ast.AST) -> str:
    """Return a name with its attributes, empty for what is none."""
    if isinstance(node, ast.Attribute):
        inner = named(node.value)
        return f"{inner}.{node.attr}" if inner else ""
    return node.id if isinstance(node, ast.Name) else ""


class Loop:
    """A `while` with a condition."""

    def __init__(self, node: ast.While) -> None:
        self.test, self.lines = node.test, node.body
        self.inside = [own for line in node.body for own in ast.walk(line)]
        self.always = [*_always(node.body)]
        self.names = {named(own) for own in ast.walk(node.test)} - {""}

    def called(self, name: str, words: tuple[str, ...], always: bool = False) -> bool:
        """Whether a method of these is called on a name, or a function of `heapq`."""
        for own in self.always if always else self.inside:
            if isinstance(own, ast.Call) and isinstance(own.func, ast.Attribute):
                holder = named(own.func.value)
                first = named(own.args[0]) if holder == "heapq" and own.args else holder
                if own.func.attr in words and first == name:
                    return True
        return False

    def given(self, name: str, always: bool = False) -> list[ast.AST]:
        """Return what is assigned to a name, or the assignment that adds to it."""
        values: list[ast.AST] = []
        for own in self.always if always else self.inside:
            if isinstance(own, ast.AugAssign) and named(own.target) == name:
                values.append(own)
            for target in own.targets if isinstance(own, ast.Assign) else ():
                pairs = [(target, own.value)]
                if isinstance(target, ast.Tuple):
                    parts = own.value.elts if isinstance(own.value, ast.Tuple) else None
                    pairs = list(zip(target.elts, parts or [own.value] * 99, strict=False))
                values += [value for one, value in pairs if named(one) == name]
        return values

    def shrinks(self) -> bool:
        """A collection or a number of the condition only gets less."""
        for name in self.names:
            gone = [t for d in self.always if isinstance(d, ast.Delete) for t in d.targets]
            gone = [t for t in gone if isinstance(t, ast.Subscript) and named(t.value) == name]
            called = self.called(name, SHRINKING, always=True)
            less = called or gone or self.given(name, always=True)
            more = self.called(name, GROWING)
            if less and not more and all(_part(own, name) for own in self.given(name)):
                return True
        return False

    def visits(self) -> bool:
        """What is taken from a list puts others there that were not seen, and are seen then."""
        if not any(self.called(name, ("pop", "popleft")) for name in self.names):
            return False
        return any(self._marked(name) for name in self._known())

    def walks(self) -> bool:
        """The condition is that a place was not seen, and it is seen then."""
        test = self.test
        if not isinstance(test, ast.Compare) or not isinstance(test.ops[0], ast.NotIn):
            return False
        return self._marked(named(test.comparators[0]))

    def _known(self) -> set[str]:
        """Return collections that places are compared with before they are put on the list."""
        known = set()
        for own in self.inside:
            if isinstance(own, ast.Compare) and isinstance(own.ops[0], ast.NotIn):
                known.add(named(own.comparators[0]))
            if isinstance(own, ast.BinOp) and isinstance(own.op, ast.Sub):
                known.add(named(own.right))
        return known - {""}

    def _marked(self, name: str) -> bool:
        """Whether something is put into a collection."""
        stored = [
            t for own in self.inside if isinstance(own, ast.Assign) for t in own.targets
            if isinstance(t, ast.Subscript) and named(t.value) == name
        ]  # fmt: skip
        more = any(isinstance(own, ast.AugAssign) for own in self.given(name))
        return bool(stored) or more or self.called(name, GROWING)

    def counts(self) -> bool:
        """A number that is compared is changed in every turn."""
        compared = {
            named(side)
            for own in ast.walk(self.test)
            if isinstance(own, ast.Compare)
            for side in ast.walk(own)
        }
        changed = [line.target for line in self.lines if isinstance(line, ast.AugAssign)]
        return any(named(own) in compared - {""} for own in changed)

    def climbs(self) -> bool:
        """A leader's leader, until one leads itself."""
        (line, *more), test = self.lines, self.test
        climb = isinstance(line, ast.Assign) and isinstance(line.value, ast.Subscript)
        leads = isinstance(test, ast.Compare) and isinstance(test.ops[0], ast.NotEq)
        return climb and leads and not more

    def renames(self) -> bool:
        """A name that is taken is changed."""
        taken = [own for own in ast.walk(self.test) if isinstance(own, ast.Compare)]
        asked = [own.left for own in taken if isinstance(own.ops[0], ast.In)]
        return len(self.lines) == 1 and any(self.given(named(own)) for own in asked if named(own))

    def ends(self) -> bool:
        """Whether one of the shapes is there."""
        shapes = (self.shrinks, self.visits, self.walks, self.counts, self.climbs, self.renames)
        return any(shape() for shape in shapes)


def _always(lines: list[ast.stmt]) -> Iterator[ast.AST]:
    """Yield the nodes that every turn of a loop comes by: none that hang on a condition."""
    for line in lines:
        if isinstance(line, ast.With | ast.Try):
            yield from _always(line.body)
        elif not isinstance(line, ast.If | ast.For | ast.While):
            yield from ast.walk(line)


def _part(value: ast.AST, name: str) -> bool:
    """Whether a value is a part of what has a name."""
    if isinstance(value, ast.AugAssign):
        return isinstance(value.op, ast.Sub)
    if isinstance(value, ast.Subscript):
        return named(value.value) == name
    if isinstance(value, ast.ListComp | ast.SetComp | ast.DictComp):
        first = value.generators[0]
        source = first.iter
        if isinstance(source, ast.Call) and isinstance(source.func, ast.Attribute):
            source = source.func.value  # items() of it
        return named(source) == name and bool(first.ifs)
    return False


def unbounded() -> set[tuple[str, str]]:
    """Return the functions with a loop that none of the shapes ends."""
    sought = [own for own in found()[0] if not isinstance(own[2].test, ast.Constant)]
    return {(module, name) for module, name, loop in sought if not Loop(loop).ends()}


# -- recursions ------------------------------------------------------------------------------------


def _recursive(node: ast.FunctionDef, method: bool) -> bool:
    """Whether a function calls itself otherwise than with a part of something."""
    inner = list(ast.walk(node))
    loops = [own.target for own in inner if isinstance(own, ast.For | ast.comprehension)]
    parts = {named(name) for target in loops for name in ast.walk(target)}
    parts |= {own.name for own in inner if isinstance(own, ast.MatchAs) and own.name}
    word = f"self.{node.name}" if method else node.name
    for call in ast.walk(node):
        if isinstance(call, ast.Call) and named(call.func) == word:
            given = [*call.args, *(own.value for own in call.keywords)]
            given = [own.value if isinstance(own, ast.Starred) else own for own in given]
            if not any(
                own.id in parts
                if isinstance(own, ast.Name)
                else isinstance(own, ast.Attribute | ast.Subscript)
                for own in given
            ):
                return True
    return False


def recursions() -> set[tuple[str, str]]:
    """Return the functions that call themselves otherwise than with parts of something."""
    return {(module, node.name) for module, node, method in found()[1] if _recursive(node, method)}


def test_loops_without_a_condition_have_a_bound_that_is_known() -> None:
    assert endless() == set(ENDLESS)


def test_loops_end_by_their_shape_or_have_a_bound_that_is_known() -> None:
    assert unbounded() == set(LOOPS)


def test_recursions_go_into_parts_or_have_a_bound_that_is_known() -> None:
    assert recursions() == set(RECURSIONS)


@pytest.mark.parametrize(
    "text",
    [
        "while front:\n  a = front.pop()\n  front.append(a)",
        "while front:\n  a = front.pop()\n  if a not in seen:\n    front += after[a]",
        "while left > 0:\n  if good:\n    left -= 1",
        "while gap > least:\n  gap = newton(gap)",
        "while rest:\n  rest = reordered(rest)",
        "while point in taken:\n  other += '_'",
    ],
)
def test_a_loop_that_may_go_on_is_no_shape_that_ends(text: str) -> None:
    (loop,) = ast.parse(text).body
    assert not Loop(loop).ends()
