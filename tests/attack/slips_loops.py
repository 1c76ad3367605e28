"""Slips planted in vector loops, orders and fixed links, seen by efforts, poses and closure."""

from __future__ import annotations

import numpy as np

import mechdae as md
from mechdae.describe.vectors.loops_in_space import joined, shortest_cycles
from tests.shared.loop_checks import (
    check_closed,
    check_same,
    check_same_in_space,
    turned,
    work_gap,
)
from tests.shared.planting import Slip
from tests.shared.vector_loops import nodes_of

ORDERS, LOOPS = "chains/test_loop_orders.py::", "describe/test_loops_of.py::"
WORK = f"{ORDERS}test_loads_between_links_do_the_same_work_whatever_is_fixed"
SAME = f"{LOOPS}test_loops_have_the_numbers_of_the_bodies"
FRAMES = f"{LOOPS}test_frames_stay_as_they_were_turned"
SPACE = "describe/test_spatial_loops.py::test_loops_in_space_have_the_numbers_of_the_bodies"
SHORT = f"{LOOPS}test_loops_are_independent_and_short"
GUIDED = f"{ORDERS}test_a_link_that_keeps_its_direction_has_a_guide"
ALL_ORDERS = f"{ORDERS}test_orders_of_the_seven_link_mechanism"


def fixed() -> float:
    """Loads between links take the same effort whatever is fixed."""
    try:
        return work_gap(True) / 1e-9
    except (AssertionError, md.MechdaeError, ValueError):
        return np.inf


def loops() -> float:
    """Mechanisms as loops have the poses of their bodies."""
    try:
        for name in ("gorshkov-seven-link", "whitworth-quick-return", "scotch-yoke", "peaucellier",
                     "toggle-clamp"):  # fmt: skip
            check_same(md.load(name))
    except (AssertionError, md.MechdaeError, ValueError, KeyError):
        return np.inf
    return 0.0


def frames() -> float:
    """Links whose frames are turned at random keep them as loops."""
    try:
        for name in ("gorshkov-seven-link", "toggle-clamp", "oscillating-cylinder"):
            check_same(turned(md.load(name), np.random.default_rng(1)))
    except (AssertionError, md.MechdaeError, ValueError, KeyError):
        return np.inf
    return 0.0


def in_space() -> float:
    """A bar and a guide beside its slider as spatial loops have the poses of their bodies."""
    try:
        check_same_in_space(md.load("rssp"), "poses")
    except (AssertionError, md.MechdaeError, ValueError, KeyError):
        return np.inf
    return 0.0


def in_a_row() -> float:
    """Three loops that meet in a row are tied at both vertices."""
    row = {"a": ("0", "1"), "b": ("1", "0"), "c": ("2", "3"), "d": ("3", "2"),
           "e": ("1", "4"), "f": ("4", "2"), "g": ("2", "1")}  # fmt: skip
    found = joined(shortest_cycles(row, "0"), row)
    entries = {str(k): [name if way else f"-{name}" for name, way in cycle]
               for k, cycle in enumerate(found)}  # fmt: skip
    return float(abs(len(set(nodes_of(list(row), entries).values())) - 5))


def orders() -> float:
    """Twelve orders of the seven-link mechanism assemble, and their vectors meet."""
    try:
        found = [v for v in md.variants("seven-link-loops", "order") if not v.fault]
        for variant in found[:4]:
            check_closed(variant, "window")
    except (AssertionError, md.MechdaeError, ValueError):
        return np.inf
    return float(abs(len(found) - 12))


HOME = "describe.vectors"
SLIPS = [
    Slip(f"{HOME}.translation", "load.positive, \"positive\": load.negative",
         "load.negative, \"positive\": load.positive", fixed, WORK),
    Slip(f"{HOME}.translation", "negative(load.free_length)", "load.free_length", fixed, WORK),
    Slip(f"{HOME}.translation", "0.0 - abscissa", "abscissa", fixed, WORK),
    Slip(f"{HOME}.translation", "between[second, first]}.angle\", -1",
         "between[second, first]}.angle\", 1", fixed, WORK),
    Slip(f"{HOME}.translation", "{cosine} - ({off[0]})", "{cosine} + ({off[0]})", fixed, WORK),
    Slip(f"{HOME}.loops_in_space", "(edge, not way)", "(edge, way)", loops, SAME),
    Slip(f"{HOME}.loops_in_space", "vertices & {*_starts(cycle, edges)}", "vertices - vertices",
         in_a_row, SHORT),
    Slip(f"{HOME}.expand", "not in reached([ends[first.name]], typed)", "not in []", loops, SAME),
    Slip(f"{HOME}.loops_of", "\"axis\" if name == vector else \"block_axis\"", "\"axis\"", frames,
         FRAMES),
    Slip(f"{HOME}.expand", "value if body == vector else", "", frames, FRAMES),
    Slip(f"{HOME}.expand", "axis=math.pi / 2", "axis=0.0", orders, GUIDED),
    Slip(f"{HOME}.loops_of", "for point in self._used if point[0] == body]",
         "for point in self._used]", loops, SAME),
    Slip(f"{HOME}.loops_in_space", "hypot({x}, {z})", "{x}", in_space, SPACE),
    Slip(f"{HOME}.loops_in_space", "row[k] * part", "row[k - 1] * part", in_space, SPACE),
    Slip("parts.types.chains.variants.orders", "angles[body] + evaluate(turn, known)",
         "angles[body] + 1.5 + evaluate(turn, known)", orders, ALL_ORDERS),
]  # fmt: skip
