"""Every loop without a condition of its own has a bound on its work that is written down here."""

from __future__ import annotations

import ast
from pathlib import Path

import mechdae

ROOT = Path(mechdae.__file__).parent

ENDLESS = {
    ("motion/assembly/multistart.py", "__call__"): (
        "starts double up to `most`", "the count is that of the solutions found"
    ),
    ("motion/assembly/spatial/hinge_loop.py", "__init__"): (
        "a joint is taken each time", "OtherShape"
    ),
    ("motion/assembly/turns/turn_lattice.py", "_cleared"): (
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
    ("motion/continuation/into_fold.py", "lead"): ("`STEPS` on the curve", "no way into the fold"),
    ("motion/continuation/obstacles.py", "_approach"): (
        "what is left shrinks by 1e-3 of itself at least, down to `APPROACH`", "the limit, or not"
    ),
    ("motion/continuation/obstacles.py", "_in_shares"): (
        "so many steps as lead to `APPROACH`", "the share to go on with"
    ),
    ("describe/vectors/in_space.py", "_fixed"): ("a vector is taken away each time", "places"),
    ("dynamics/clock.py", "stretch"): ("each look reaches further, up to the end", "a stretch"),
    ("parts/exchange/robots/link_tree.py", "_chosen"): (
        "a body is reached each time", "the joints"
    ),
    ("numerics/homotopy/canonical.py", "refined"): (
        "there are more colours each time", "the colours"
    ),
    ("numerics/homotopy/generic_count.py", "count"): ("subsets are counted down", "the count"),
    ("motion/kinematics/near_numbers.py", "_expressions"): (
        "a parameter is taken each time", "pairs"
    ),
    ("parts/types/schemes/front.py", "front_of"): ("an entry is judged each time", "the front"),
    ("design/synthesis/exact/generic.py", "generic"): (
        "`TRIPS` trips, `WORK` paths", "basis `none`"
    ),
}  # fmt: skip
"""By module and function: what bounds `while True`, and what is said where the bound is met."""


def endless() -> set[tuple[str, str]]:
    """Return the innermost functions with a loop whose condition is always true."""
    found = set()
    for path in ROOT.rglob("*.py"):
        place = path.relative_to(ROOT).as_posix()

        def look(node: ast.AST, function: str, place: str = place) -> None:
            if isinstance(node, ast.FunctionDef):
                function = node.name
            if isinstance(node, ast.While) and isinstance(node.test, ast.Constant):
                found.add((place, function))
            for child in ast.iter_child_nodes(node):
                look(child, function)

        look(ast.parse(path.read_text(encoding="utf-8")), "")
    return found


def test_loops_without_a_condition_have_a_bound_that_is_known() -> None:
    assert endless() == set(ENDLESS)
