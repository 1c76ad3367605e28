"""The store of structures counts the kernels that lie in caches of what it holds."""

from __future__ import annotations

from types import SimpleNamespace

import casadi as ca

import mechdae as md
from mechdae.equations.structure_cache import StructureCache
from mechdae.motion.kinematics.prepared import prepare, size_of


def test_caches_of_what_is_held_are_counted() -> None:
    x = ca.SX.sym("x")
    function = ca.Function("f", [x], [ca.sin(x) * x])
    inner, outer, alone = StructureCache(), StructureCache(), StructureCache()
    inner("function", lambda: function)
    outer("held", lambda: SimpleNamespace(cache=inner))
    alone("function", lambda: function)
    assert size_of(outer) == size_of(alone) > 0


def test_what_structures_hold_has_its_cache_under_that_name() -> None:
    problem = md.load("four-bar-crank-rocker")
    setting = prepare(problem, problem.task("turn"))
    assert isinstance(setting.graphs.cache, StructureCache)
    assert all(isinstance(block.cache, StructureCache) for block in setting.graphs.blocks)
