"""The same call gives the same digits, whatever was solved before it in the process.

The optimum of ``wishbone-poses`` is flat: its tie rod's end may move by 1e-9 m along one line while
the objective stays at the square of rounding, so any difference in the numbers on the way there
shows in the design.
"""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

ORDERS = (("wishbone-poses", "rssr-path", "double-wishbone"),
          ("double-wishbone", "rssr-path", "wishbone-poses"))  # fmt: skip
PROGRAM = """
import json, sys
import mechdae as md

found = {}
for name in sys.argv[1:]:
    problem = md.load(name)
    for task, what in problem.tasks.items():
        if what.kind == "synthesis":
            designs = md.synthesize(problem, task, starts=3).data["designs"]
            found[name] = [
                [design["objective"].hex(), *(v.hex() for v in design["parameters"].values())]
                for design in designs
            ]
        elif what.kind == "sweep":
            result = md.solve(problem, task)
            found[f"{name} {task}"] = {
                point: own.position.tobytes().hex() for point, own in result.points.items()
            }
print(json.dumps(found))
"""


def digits(order):
    """Return all numbers of problems solved in one process, in hexadecimal."""
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM, *order], capture_output=True, text=True, check=True
    )
    return json.loads(run.stdout)


@pytest.mark.slow
def test_two_orders_give_the_same_digits() -> None:
    first, second = (digits(order) for order in ORDERS)
    assert set(first) == set(second)
    assert {"wishbone-poses", "rssr-path"} < set(first)
    assert all(first[name] for name in first)
    for name, own in first.items():
        assert second[name] == own, name
