"""Poses near change points: a block's own equations lose all digits there.

The unknowns of the crossing blocks come from the branch's expansion through the crossing; where
branches are known to pass each other they are solved for in 50 digits, from there. All others are
solved for as usual.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Batch
from mechdae.motion.cases.hard_steps.crossings.across_change_point import Zone
from mechdae.motion.continuation.any_path import AnyPath
from mechdae.motion.continuation.step_sizes import PASS
from mechdae.types import Booleans, Floats, Integers, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.cases.hard_steps.crossings.exact_poses import ExactPose

Rates = tuple[Any, ...]
PASSES = 2


class ZonePoses:
    """Writes the poses near change points into the results of the pose kernel."""

    def __init__(self, graphs: Graphs) -> None:
        self.graphs = graphs
        self._exact: dict[tuple[Zone, float], ExactPose | None] = {}

    def estimated(self, path: AnyPath, s: Floats, places: Floats) -> bool:
        """Return whether a bound of the poses at `s`, which the path passes at `places`, is none.

        Those of branches that pass each other are proved where the pose was solved in 50 digits.
        """
        index = path.zone_at(places)
        return any(
            path.zones[k].action != PASS or self._exact.get((path.zones[k], at)) is None
            for k, at in zip(index.tolist(), s.tolist(), strict=True)
            if k >= 0
        )

    def _function(self, blocks: frozenset[int]) -> Batch:
        def make() -> Batch:
            function = self.graphs.held(blocks)
            return Batch(function, [function.n_in() - 4])

        return self.graphs.cache(("held", blocks), make)

    def held(self, path: AnyPath, s: Floats) -> Booleans:
        """Return which blocks are given by the expansion at a change point, (n, nb)."""
        held = np.zeros((len(s), self.graphs.nb), bool)
        index = path.zone_at(s)
        for row in np.flatnonzero(index >= 0):
            held[row, sorted(path.zones[index[row]].blocks)] = True
        return held

    def write(
        self,
        path: AnyPath,
        s: Floats,
        places: Floats,
        guess: Unknowns,
        results: list[Floats],
        rates: Rates,
        pose: Callable[[Any, Any, Rates], list[Any]],
    ) -> None:
        """Replace the results at poses whose `places` on the path lie in a zone.

        `s` is the same, or whole turns of the driver away. `pose` is the ordinary kernel
        (x, s, rates) -> results; at the ends of the zones it gives the errors that the expansion
        passes on.
        """
        index = path.zone_at(places)
        rows = np.flatnonzero(index >= 0)
        if not rows.size:
            return
        used = sorted(set(index[rows].tolist()))
        ends = np.array([[path.zones[k].low, path.zones[k].high] for k in used]).ravel()
        corners = np.concatenate([path.zones[k].nodes[1][[0, -1]] for k in used])
        still = (np.zeros((len(ends), self.graphs.nu)),) * len(self.graphs.driven)
        passed = pose(corners, ends, still)[1].reshape(len(used), 2, -1).max(axis=1)
        x, v, a, error = (np.empty((len(rows), self.graphs.nx)) for _ in range(4))
        zones = index[rows]
        for k, inherited in zip(used, passed, strict=True):
            here = np.flatnonzero(zones == k)
            zone = path.zones[k]
            columns = [i for b in sorted(zone.blocks) for i in self.graphs.blocks[b].own]
            x[here], v[here], a[here] = zone.carried(places[rows[here]], columns)
            error[here] = 2 * inherited + zone.remainder
            if zone.action == PASS:
                self._sharpen(path, zone, s[rows[here]], here, (x, v, a, error))
        kinds = [path.zones[k].blocks for k in zones]
        for blocks in dict.fromkeys(kinds):
            here = np.array([i for i, kind in enumerate(kinds) if kind == blocks])
            some = rows[here]
            expanded = [part[here] for part in (x, v, a, error)]
            moving = [] if self.graphs.single else [rate[some] for rate in rates]
            found = self._solved(blocks, path, s[some], guess[some], moving, expanded)
            for whole, new in zip(results, found, strict=True):
                whole[some] = new

    def _sharpen(
        self, path: AnyPath, zone: Zone, s: Floats, rows: Integers, parts: tuple[Any, ...]
    ) -> None:
        """Solve for the crossing block in 50 digits in `rows` of x, x', x'' and error, in place.

        The drivers have their values at `s`. What is not proved stays as it is.
        """
        from mechdae.motion.cases.hard_steps.crossings.exact_poses import ExactPoses

        (crossing,) = zone.crossings
        g, b = self.graphs, crossing.block
        unknowns, n = g.blocks[b].own, g.nx
        _, J, _ = g.blocks[b].value_at(
            zone.nodes[1][0], path.drivers(np.array([zone.low]))[0], path.constants.p
        )
        sign, solver = float(np.sign(np.linalg.det(J))), ExactPoses(g, path.constants)
        for row, at in zip(rows.tolist(), s.tolist(), strict=True):
            key = (zone, at)
            if key not in self._exact:
                whole = [parts[0][row], parts[1][row], parts[2][row], np.zeros(n)]
                self._exact[key] = solver.at(b, path.motion(at), whole, sign)
            found = self._exact[key]
            if found is not None:
                values = (found.x, found.v, found.a, found.error)
                for whole, value in zip(parts, values, strict=True):
                    whole[row, unknowns] = value

    def _solved(
        self,
        blocks: frozenset[int],
        path: AnyPath,
        s: Floats,
        guess: Unknowns,
        rates: list[Floats],
        expanded: list[Floats],
    ) -> list[Floats]:
        """Return the results at poses of a zone: unknowns of `blocks` by their expansion."""
        given = {i for b in blocks for i in self.graphs.blocks[b].own}
        outside = np.array([i for i in range(self.graphs.nx) if i not in given], int)
        start, *terms = expanded
        start[:, outside] = guess[:, outside]
        u, consts, function = path.drivers(s), path.constants.consts, self._function(blocks)
        for _ in range(PASSES):
            part = function(start, u, *rates, consts, *terms)
            start = part[0]
        part[3][~np.isfinite(part[3])] = np.inf
        return part
