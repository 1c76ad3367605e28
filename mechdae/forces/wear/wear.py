"""Pressure, sliding speed and their product in contacts, over poses and along a cycle.

Along a cycle peaks and means are those of the motion, not of its poses: formulas of forces change
at kinks, between which peaks are narrowed and integrals taken by adaptive quadrature.
"""

from __future__ import annotations

import itertools

import numpy as np

from mechdae.forces.cycle import interval
from mechdae.forces.formula_changes import SAMPLES, State, kinks_of
from mechdae.forces.pose_forces import PoseForces
from mechdae.forces.poses import LoadedRun
from mechdae.forces.uniqueness import Uniqueness
from mechdae.forces.wear.surfaces import Surfaces, has_surface
from mechdae.numerics.changes import Guide
from mechdae.numerics.least import narrowed
from mechdae.numerics.quadrature import Substitution, integrate
from mechdae.results.series import LazyPart, Summary
from mechdae.types import Floats, Integers, Json

WORDS = ("pressure", "sliding_speed", "pv")
INSIDE = 1e-12
"""Share of its width by which one keeps inside an interval between kinks."""
LEAST = 8
"""Places in each of these, at least."""


def along(
    loaded: LoadedRun,
    answer: PoseForces,
    unique: Uniqueness | None,
    series: dict[str, dict[str, Floats]],
    summary: Summary,
) -> None:
    """Add pressure, sliding speed and wear of contacts to the series and summary of forces.

    The summary has them along a cycle that goes all the way without a jam: joint ->
    ``peak_pressure`` [Pa], ``peak_pv``, ``mean_pv`` [W/m^2], ``sliding_distance`` [m] over the
    cycle.
    """
    statics, joints = loaded.statics, loaded.setting.scene.model.mechanism.joints
    every = [name for name in statics.balance.joints if has_surface(joints[name])]
    names = [n for n in every if unique is None or unique.given(statics.balance, n, "reaction")]
    open_ones = ", ".join(name for name in every if name not in names)
    notes = [f"{open_ones}: no pressure, the reaction is not unique"] if open_ones else []
    if names:
        surfaces = Surfaces(statics, names, answer.motion, answer.whole)
        values = surfaces.at(answer.motion, answer.whole)
        values[~answer.standing] = np.nan
        notes += [
            f"joint {name}: its tip is less curved than the curve's hollow, it does not touch "
            "along one line and has no pressure of Hertz there"
            for k, name in enumerate(names)
            if np.isnan(values[answer.standing, k, 0]).any()
        ]
        for k, name in enumerate(names):
            series[name] |= dict(zip(WORDS, values[:, k].T, strict=True))
        if "kinks" in summary and not summary["jammed_arcs"]:
            summary["wear"] = LazyPart(lambda: {"wear": over_cycle(loaded, answer, surfaces)})
    if notes:
        summary["notes"] = [*summary.get("notes", []), *notes]


class WearState(State):
    """What decides which formula holds of contacts too: which side is pressed, where it slides."""

    def __init__(self, loaded: LoadedRun, answer: PoseForces, surfaces: Surfaces) -> None:
        super().__init__(loaded.statics, loaded.moving)
        self.surfaces, self.coupled = surfaces, answer.coupled

    def marks(self, here: PoseForces) -> tuple[Integers, Floats, list[Guide]]:
        marks, values, guides = super().marks(here)
        numbers, normals, force, speeds = self.surfaces.parts(here.motion, here.whole)
        tilts = np.where(numbers[..., 6] > 0, force - np.abs(normals), 0.0)
        loose = self.surfaces.loose
        pressed = (np.where(np.abs(part) > loose, part, 0.0) for part in (normals, tilts))
        added = np.hstack([*pressed, speeds])
        added = np.nan_to_num(added)
        start = values.shape[1]
        guides += [("sign", slice(start + k, start + k + 1)) for k in range(added.shape[1])]
        signs = np.sign(added).astype(int)
        return np.hstack([marks, signs]), np.hstack([values, added]), guides

    def wear(self, places: Floats) -> Floats:
        """Return pressures, sliding speeds and their products at places, (n, k, 3)."""
        here = self.at(places, self.coupled)
        return self.surfaces.at(here.motion, here.whole)


def over_cycle(loaded: LoadedRun, answer: PoseForces, surfaces: Surfaces) -> dict[str, Json]:
    """Return peaks, means and distances of contacts by joint."""
    state = WearState(loaded, answer, surfaces)
    low, high = interval(loaded.moving)
    kinks = [place for place in kinks_of(state, answer)[0] if low < place < high]
    panels = [(a, b) for a, b in itertools.pairwise([low, *kinks, high]) if b > a]
    peaks = _peaks(state, panels)

    def rates(places: Floats) -> Floats:
        return state.wear(places)[..., 1:].reshape(len(places), -1)

    charts = [Substitution(a, b) for a, b in panels]
    sizes = np.maximum(peaks[:, 1:].ravel() * (high - low), np.finfo(float).tiny)
    integrals, _ = integrate(rates, charts, np.abs, lambda _: sizes)
    speed = abs(loaded.moving.speed)
    contacts = {}
    for name, peak, (way, pv) in zip(
        surfaces.names, peaks, integrals.reshape(-1, 2).tolist(), strict=True
    ):
        contacts[name] = {
            "peak_pressure": float(peak[0]), "peak_pv": float(peak[2]),
            "mean_pv": pv / (high - low), "sliding_distance": way / speed,
        }  # fmt: skip
    return contacts


def _peaks(state: WearState, panels: list[tuple[float, float]]) -> Floats:
    """Return the largest values of all contacts, (k, 3), between kinks and at them."""
    whole = panels[-1][1] - panels[0][0]
    grids = []
    for a, b in panels:
        count = max(LEAST, int(np.ceil(SAMPLES * (b - a) / whole)))
        grids.append(np.linspace(a + INSIDE * (b - a), b - INSIDE * (b - a), count + 1))
    places = np.concatenate(grids)
    ends = np.cumsum([len(grid) for grid in grids])
    values = state.wear(places)
    shape = values.shape[1:]
    values = values.reshape(len(places), -1)
    if not np.isfinite(values).all(axis=0).any():
        return np.full(shape, np.nan)
    top = np.argmax(np.where(np.isfinite(values), values, -np.inf), axis=0)
    panel = np.searchsorted(ends, top, side="right")
    first = np.concatenate([[0], ends[:-1]])[panel]
    a, b = places[np.maximum(top - 1, first)], places[np.minimum(top + 1, ends[panel] - 1)]
    rows = np.arange(len(top))

    def look(at: Floats) -> Floats:
        every = state.wear(at.ravel()).reshape(*at.shape, -1)
        least: Floats = -every[rows, :, rows]
        return least

    best = -look(narrowed(look, a, b)[:, None])[:, 0]
    best = np.fmax(best, values[top, rows])
    best[~np.isfinite(values).all(axis=0)] = np.nan
    peaks: Floats = best.reshape(shape)
    return peaks
