"""Where a contact leaves an open curve: the end of its group's motion.

Between the nodes of a path the contact's place follows the quintic pieces of the path; a
place outside the range is then located on the solution itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

import casadi as ca
import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.motion.continuation.interpolate import quintic
from mechdae.motion.continuation.limit_positions import Limit
from mechdae.numerics.roots import root_between
from mechdae.types import Floats, Matrix, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.cases.curve_contacts import Contact

PIECES = 8
"""Places looked at between two nodes."""
ZOOMS = 6
"""Times that the surroundings of a largest value are looked at more closely."""
CLOSE = 4e-16
"""Distance of two places that is rounding, over them or the largest step."""
SLACK = 1e-13
"""Share of the range by which rounding may put a contact outside."""


class CurveNodes(Protocol):
    """What is asked of the path whose contacts are watched."""

    @property
    def origin(self) -> tuple[float, Any]: ...
    @property
    def largest(self) -> float: ...
    def arrays(self) -> tuple[Any, Any, Any, Any]: ...
    def drivers(self, s: Any) -> Any: ...
    def at(self, s: float) -> Any: ...


class CurveEnds:
    """Watches the contacts of a scene's open curves.

    Attributes
    ----------
    groups : list of int
        Groups that have a contact on any curve.
    watched, in_pieces : set of int
        Groups that have one on an open curve, on one made of pieces.
    """

    def __init__(self, graphs: Graphs, p: Floats) -> None:
        self.graphs: Graphs = graphs
        self.p: Floats = p
        owner = {name: group.index for group in graphs.scene.groups for name in group.joints}
        self.groups: list[int] = sorted({owner[contact.joint.name] for contact in graphs.contacts})
        self.open: list[Contact] = [contact for contact in graphs.contacts if not contact.closed]
        self._owner = owner
        self.in_pieces: set[int] = {owner[c.joint.name] for c in graphs.contacts if c.pieces}
        self.watched: set[int] = {owner[contact.joint.name] for contact in self.open}
        self._seen: dict[bool, float] = {}
        if self.open:
            scene = graphs.scene
            places = ca.vertcat(*[contact.s for contact in self.open])
            inputs = [scene.x, scene.u, scene.model.p]
            self._places = scene.cache(
                "open curves", lambda: ca.Function("s", inputs, [scene.expression(places)])
            )

    def places(self, x: Unknowns, u: Floats) -> Matrix:
        """Return s of the open curves' contacts (n, k) at poses x (n, nx), u (n, nu)."""
        return np.array(self._places(x.T, u.T, self.p[:, None])).T

    def restart(self) -> None:
        """Forget what was seen: the path begins again."""
        self._seen.clear()

    def left(self, path: CurveNodes, up: bool) -> list[Limit]:
        """Return where contacts left their curves on the nodes added since the last call."""
        if not self.open:
            return []
        S, X, V, A = path.arrays()
        seen = self._seen.get(up, path.origin[0])
        far = S[-1] if up else S[0]
        self._seen[up] = far
        if far == seen:
            return []
        first, last = (seen, far) if up else (far, seen)
        # one node more: a largest value may lie next to the node that was the last one
        k, m = int(np.searchsorted(S, first)), int(np.searchsorted(S, last)) + 1
        nodes = S[max(k - 1, 0) : m] if up else S[k : m + 1]
        share = np.arange(PIECES) / PIECES
        fine = (nodes[:-1, None] + np.diff(nodes)[:, None] * share).ravel()
        fine = np.append(fine, nodes[-1])
        fine = fine if up else fine[::-1]

        def on_curves(places: Floats) -> Matrix:
            return self.places(quintic(S, X, V, A, places), path.drivers(places))

        s = on_curves(fine)
        found = []
        for j, contact in enumerate(self.open):
            name, (low, high) = contact.joint.name, contact.range
            for sense, end in ((-1.0, low), (1.0, high)):

                def beyond(
                    places: Floats, j: int = j, sense: float = sense, end: float = end
                ) -> Floats:
                    return sense * (on_curves(places)[:, j] - end)

                slack = SLACK * (high - low)
                inside, outside = _first_beyond(beyond, fine, sense * (s[:, j] - end), slack)
                if outside is None:
                    continue
                place = self._located(path, j, end, inside, outside)
                x = path.at(place)
                found.append(Limit(place, -1, self._owner[name], "end_of_curve", x, joint=name))
        return found

    def _located(self, path: CurveNodes, j: int, end: float, a: float, b: float) -> float:
        """Return the path's place in [a, b] at which the contact is at `end` of its curve."""

        def beyond(s: float) -> float:
            u = path.drivers(np.array([s]))
            return float(self.places(path.at(s)[None, :], u)[0, j]) - end

        fa, fb = beyond(a), beyond(b)
        if fa * fb > 0:
            return a if abs(fa) < abs(fb) else b
        return root_between(
            beyond, a, b, (fa, fb), lambda place: CLOSE * max(abs(place), path.largest)
        )


def _first_beyond(
    value: Callable[[Any], Any], places: Any, at: Any, slack: float
) -> tuple[float, float | None]:
    """Return a place where `value` is at most 0 and the first one found where it is above.

    `at` (n,) are the values at `places` (n,). Between them the largest values are looked for:
    a contact may pass the end of its curve and come back within a step.
    """
    above = np.flatnonzero(at > slack)
    last = int(above[0]) if above.size else len(at)
    padded = np.concatenate([[-np.inf], at, [-np.inf]])
    for k in np.flatnonzero((at >= padded[:-2]) & (at >= padded[2:])):
        if k >= last:
            break
        before = float(places[max(k - 1, 0)])
        a, b = before, float(places[min(k + 1, len(at) - 1)])
        for _ in range(ZOOMS):
            grid = np.linspace(a, b, PIECES + 1)
            found = value(grid)
            best = int(np.argmax(found))
            if found[best] > slack:
                return before, float(grid[best])
            a, b = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, PIECES)])
    if not above.size:
        return float(places[-1]), None
    return float(places[max(last - 1, 0)]), float(places[last])
