"""The task of kind play: a sweep whose points, bodies and joints have bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.forces.poses import loaded_run
from mechdae.forces.task import with_forces
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.report import report
from mechdae.motion.kinematics.sweep import run
from mechdae.parts.play.bands import BandGraphs, Bands, bands
from mechdae.parts.play.gaps import JointGap, gaps_of, offsets, reversals, support
from mechdae.parts.play.task import Play
from mechdae.records import dataclass
from mechdae.results import FINE, LazyPart, Named, Series, SweepResult, among
from mechdae.results.status import stretches
from mechdae.types import Booleans, Floats, Json

DIRECTIONS = 36
"""In which the band of a point is measured, over half a turn."""
TURNS = np.array([f(np.pi * np.arange(DIRECTIONS) / DIRECTIONS) for f in (np.cos, np.sin)])
WIDEST = float(1 / np.cos(np.pi / (2 * DIRECTIONS)))
"""How much further a point may be between two of them."""
NOTHING = 1e-9
"""Share of a band that is rounding."""
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

    @property
    def columns(self) -> range:
        return range(self.at.start, self.at.stop)


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
    quantities = _quantities(result)
    paths = [quantity.path for quantity in quantities]
    graphs = scene.cache(("bands", *paths), lambda: BandGraphs(scene, paths))
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


def _quantities(result: SweepResult) -> list[BandedQuantity]:
    """Return what has a band."""
    found = [("bodies", body, "angle", 1) for body in result.bodies]
    found += [("points", point, "position", 2) for point in result.points]
    for joint, series in result.joints.items():
        found += [("joints", joint, name, 1) for name in ("slide", "angle") if name in series]
    ends = np.cumsum([0, *[width for *_, width in found]]).tolist()
    return [
        BandedQuantity(kind, part, name, slice(end, end + width))
        for (kind, part, name, width), end in zip(found, ends, strict=False)
    ]


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
        lengths = [quantity.name != "angle" for quantity in quantities for _ in quantity.columns]
        bounds = [swept.bound.get(unit, np.zeros(len(swept))) for unit in ("angle", "length")]
        self.first = found.shares.sum(axis=-1)
        self.rest = found.rest + np.stack(bounds, axis=1)[:, np.array(lengths, int)]
        self.band, self.reached = self.first + self.rest, np.maximum(self.first - self.rest, 0.0)

    def result(self) -> SweepResult:
        """Return the result with its bands."""
        series: dict[tuple[str, str], dict[str, Floats | LazyPart]] = {}
        for quantity in self.quantities:
            series.setdefault((quantity.kind, quantity.part), {}).update(self._arrays(quantity))
        for gap, offset in zip(self.gaps, self.pressed or (), strict=bool(self.pressed)):
            for name, unit in (("gap_offset", "m"), ("gap_turn", "rad")):
                found = offset[:, [word == unit for word in gap.units]]
                if found.shape[1]:
                    shown = found if found.shape[1] > 1 else found[:, 0]
                    series.setdefault(("joints", gap.joint), {})[name] = shown
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

    def _arrays(self, quantity: BandedQuantity) -> dict[str, Floats | LazyPart]:
        """Return the bands of a quantity by the names of their series."""
        name, at = quantity.name, quantity.at
        arrays = {"band": self.band[:, at], "reached": self.reached[:, at]}
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
        if quantity.kind != "points":
            return self.band[:, quantity.at.start], self.found.shares[:, quantity.at.start]
        x, y = np.moveaxis(self.found.forms[:, quantity.at], 1, 0)[..., None]
        forms = x * TURNS[0] + y * TURNS[1]  # (n, rows, directions)
        shares = np.stack([
            support(gap.disc, [forms[:, k] for k in gap.rows], np.hsplit(gap.reach, len(gap.rows)))
            for gap in self.gaps
        ])  # fmt: skip
        shares[:, ~self.found.proved] = np.nan
        whole = shares.sum(axis=0)
        furthest = (np.arange(len(whole)), np.nan_to_num(whole).argmax(axis=1))
        aside = np.hypot(*self.rest[:, quantity.at].T)
        return WIDEST * whole[furthest] + aside, shares[:, *furthest].T

    def _summary(self) -> Json:
        """Return what the summary says."""
        largest = {quantity.path: self._largest(quantity) for quantity in self.quantities}
        found: Json = {
            "largest": {path: entry for path, entry in largest.items() if entry},
            "unbounded": self._unbounded(),
        }
        if self.pressed is not None:
            found["reversals"] = [
                self._reversal(gap, offset[k] - offset[k - 1], k)
                for gap, offset in zip(self.gaps, self.pressed, strict=True)
                for k in np.flatnonzero(reversals(gap, offset)).tolist()
            ]
        return found

    def _reversal(self, gap: JointGap, step: Floats, k: int) -> Json:
        """Return between which poses a joint changes sides, and what each output loses there."""
        moved = self.found.forms[k][:, gap.rows] @ step
        lost: dict[str, float] = {}
        for quantity in self.quantities:
            size, band = (np.linalg.norm(a[quantity.at]) for a in (moved, self.band[k]))
            if size > NOTHING * band:
                lost[quantity.path] = float(size)
        ends = {"from": float(self.at[k - 1]), "to": float(self.at[k])}
        return {"joint": gap.joint, **ends, "lost": lost}

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
        return [
            {"from": float(self.at[first]), "to": float(self.at[end - 1])}
            for first, end in stretches(lost)
        ]
