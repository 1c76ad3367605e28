"""The task of kind play: a sweep whose points, bodies and joints have bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.equations.model import Model
from mechdae.forces.poses import loaded_run
from mechdae.forces.task import with_forces
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.report import report
from mechdae.motion.kinematics.sweep import run
from mechdae.parts.play.bands import BandGraphs, Bands, bands
from mechdae.parts.play.gaps import JointGap, gaps_of
from mechdae.parts.play.loads import offsets, reversals
from mechdae.parts.play.task import Play
from mechdae.records import dataclass
from mechdae.results import FINE, LazyPart, Named, Series, SweepResult, among
from mechdae.types import Booleans, Floats, Json, Sym

DIRECTIONS = 36
"""In which the band of a point is measured, over half a turn."""
WIDEST = float(1 / np.cos(np.pi / (2 * DIRECTIONS)))
"""How much further a point may be between two of them."""
NO_BAND = "no pose has a proved band: the clearances are too large, or it is near a limit position"
NAMES = {"bodies": "body", "points": "point", "joints": "joint"}


@dataclass(frozen=True)
class BandedQuantity:
    """What has a band: a series ``name`` of a ``part``, the columns ``at`` among the outputs."""

    kind: str
    part: str
    name: str
    at: slice

    @property
    def path(self) -> str:
        return f"{self.kind}/{self.part}/{self.name}"


def play(problem: Problem, name: str, task: Play) -> SweepResult:
    """Return the result of a task of kind play: that of a sweep, with bands.

    Points have ``position_band`` (n, 2), bodies ``angle_band`` (n,), joints ``slide_band`` and
    ``angle_band`` (n,): half widths that are never left; ``..._reached`` are certainly reached,
    ``distance_band`` (n,) is how far a point may be from its place. nan where nothing is proved.
    Under load ``..._shift`` is where the reactions press it, to first order.

    Raises
    ------
    MechanismError
        A gap as large as a link.
    UnavailableError
        Redundant equations, curves with divisors.
    """
    if task.under_load:
        forces = task.with_forces()
        loaded = loaded_run(problem, forces)
        setting, followed = loaded.setting, loaded.run
        result = report(problem, name, task, setting, followed)
        whole = with_forces(result, loaded, replace(forces, outputs=None))[0]
        reactions, shown = whole.joints, whole.joints
        if task.outputs is not None:
            chosen = loaded.setting.scene.selection.joints
            shown = Named("joint", {name: reactions[name] for name in reactions if name in chosen})
        result = whole.as_kind(type(whole), joints=shown)
    else:
        setting = prepare(problem, task)
        followed = run(setting, task)
        result = report(problem, name, task, setting, followed)
    scene, p = setting.scene, setting.scene.model.p_values
    quantities, outputs = _quantities(scene.model, result)
    key = ("bands", *[quantity.path for quantity in quantities])
    graphs = scene.cache(key, lambda: BandGraphs(scene, outputs))
    q = graphs.recovered(followed.poses.x, followed.values, p)[0]
    q[~among(result.codes, FINE)] = np.nan
    pose = (q, followed.values, p)
    gaps = gaps_of(scene.model.mechanism, graphs.rows, graphs.distances(*pose))
    sizes = scene.recovered.sizes(scene.model.mechanism.scale)
    found = bands(graphs, gaps, pose, sizes)
    pressed = None
    if task.under_load:
        pressed = offsets(gaps, [graphs.openings(gap, pose) for gap in gaps], reactions)
    at = followed.values[:, setting.plan.lead]
    return _Banded(result, quantities, found, gaps, pressed, at).result()


def _quantities(model: Model, result: SweepResult) -> tuple[list[BandedQuantity], list[Sym]]:
    """Return what has a band, and its expressions over the coordinates of all bodies."""
    found = [("bodies", body, "angle", [model.frame(body).angle]) for body in result.bodies]
    found += [("points", p, "position", model.point(p).elements()) for p in result.points]
    for joint, series in result.joints.items():
        for name, value, _ in model.joint_quantities(joint):
            if name in ("slide", "angle") and name in series:
                found.append(("joints", joint, name, [value]))
    quantities, outputs = list[BandedQuantity](), list[Sym]()
    for kind, part, name, values in found:
        at = slice(len(outputs), len(outputs) + len(values))
        quantities.append(BandedQuantity(kind, part, name, at))
        outputs += values
    return quantities, outputs


class _Banded:
    """A result of a sweep, and the bands of its quantities.

    Parameters
    ----------
    pressed
        By gap where loads hold the joint, (n, rows); None without loads.
    at
        Values of the driver that moves, (n,).
    """

    def __init__(
        self, swept: SweepResult, quantities: Sequence[BandedQuantity], found: Bands,
        gaps: Sequence[JointGap], pressed: Sequence[Floats] | None, at: Floats,
    ) -> None:  # fmt: skip
        self.swept, self.quantities, self.found = swept, quantities, found
        self.gaps, self.pressed, self.at = gaps, pressed, at

    def result(self) -> SweepResult:
        """Return the result with its bands."""
        series: dict[tuple[str, str], dict[str, Floats | LazyPart]] = {}
        for quantity in self.quantities:
            series.setdefault((quantity.kind, quantity.part), {}).update(self._arrays(quantity))
        changes: Json = {}
        for kind, word in NAMES.items():
            parts = getattr(self.swept, kind).items()
            changes[kind] = Named(
                word, {p: Series({**part.open(), **series.get((kind, p), {})}) for p, part in parts}
            )
        summary = self.swept.summary.changed(play=LazyPart(lambda: {"play": self._summary()}))
        if among(self.swept.codes, FINE).any() and not self.found.proved.any():
            summary["notes"] = [*summary.get("notes", []), NO_BAND]
        return self.swept.as_kind(type(self.swept), summary=summary, **changes)

    def _first_and_rest(self, quantity: BandedQuantity) -> tuple[Floats, Floats]:
        """Return what the gaps do to first order (n, k), and a bound of the rest."""
        unit = "length" if quantity.name in ("position", "slide") else "angle"
        bound = self.swept.bound.get(unit, np.zeros(len(self.swept)))
        rest = self.found.rest[:, quantity.at] + bound[:, None]
        return self.found.shares[:, quantity.at].sum(axis=-1), rest

    def _arrays(self, quantity: BandedQuantity) -> dict[str, Floats | LazyPart]:
        """Return the bands of a quantity by the names of their series."""
        name, (first, rest) = quantity.name, self._first_and_rest(quantity)
        arrays = {"band": first + rest, "reached": np.maximum(first - rest, 0.0)}
        if self.pressed is not None:
            arrays["shift"] = np.where(self.found.proved[:, None], self._shift(quantity), np.nan)
        wide = quantity.kind == "points"
        series: dict[str, Floats | LazyPart] = {
            f"{name}_{word}": array if wide else array[:, 0] for word, array in arrays.items()
        }
        if wide:
            later = LazyPart(lambda: {"distance_band": self._widest(quantity)[0]})
            series["distance_band"] = later
        return series

    def _shift(self, quantity: BandedQuantity) -> Floats:
        """Return where the reactions press a quantity, (n, k)."""
        forms = self.found.forms[:, quantity.at]
        shift = np.zeros(forms.shape[:2])
        for gap, offset in zip(self.gaps, self.pressed or (), strict=True):
            shift += (forms[..., gap.rows] @ offset[..., None])[..., 0]
        return shift

    def _widest(self, quantity: BandedQuantity) -> tuple[Floats, Floats]:
        """Return the band (n,), of a point how far it may be, and shares of gaps (n, gaps)."""
        first, rest = self._first_and_rest(quantity)
        if quantity.kind != "points":
            return (first + rest)[:, 0], self.found.shares[:, quantity.at.start]
        turns = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        x, y = np.moveaxis(self.found.forms[:, quantity.at], 1, 0)[..., None]
        forms = x * np.cos(turns) + y * np.sin(turns)  # (n, rows, directions)
        scaled = [[forms[:, k] * reach for k, reach in gap.opened] for gap in self.gaps]
        shares = np.stack([gap.support(s) for gap, s in zip(self.gaps, scaled, strict=True)])
        shares[:, ~self.found.proved] = np.nan
        whole = shares.sum(axis=0)
        furthest = (np.arange(len(whole)), np.nan_to_num(whole).argmax(axis=1))
        return WIDEST * whole[furthest] + np.hypot(*rest.T), shares[:, *furthest].T

    def _summary(self) -> Json:
        """Return what the summary says."""
        largest = {quantity.path: self._largest(quantity) for quantity in self.quantities}
        found: Json = {
            "largest": {path: entry for path, entry in largest.items() if entry},
            "unbounded": self._unbounded(),
        }
        if self.pressed is not None:
            found["reversals"] = [
                {"joint": gap.joint, "from": float(self.at[k - 1]), "to": float(self.at[k])}
                for gap, offset in zip(self.gaps, self.pressed, strict=True)
                for k in np.flatnonzero(reversals(offset)).tolist()
            ]
        return found

    def _largest(self, quantity: BandedQuantity) -> Json:
        """Return where a band is widest, with the share of each joint; nothing without a band."""
        band, shares = self._widest(quantity)
        if not np.nansum(shares):
            return {}
        k = int(np.nanargmax(band))
        each = {gap.joint: float(share) for gap, share in zip(self.gaps, shares[k], strict=True)}
        return {
            "band": float(band[k]),
            "at": float(self.at[k]),
            "joint": max(each, key=lambda joint: each[joint]) if any(each.values()) else None,
            "shares": each,
            "price": {gap.joint: each[gap.joint] / gap.size for gap in self.gaps},
        }

    def _unbounded(self) -> list[Json]:
        """Return from where to where poses have no band although they are there."""
        lost: Booleans = among(self.swept.codes, FINE) & ~self.found.proved
        edges = np.flatnonzero(np.diff(np.concatenate([[False], lost, [False]]).astype(int)))
        return [
            {"from": float(self.at[first]), "to": float(self.at[end - 1])}
            for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
        ]
