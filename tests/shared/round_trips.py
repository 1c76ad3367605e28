"""Mechanisms of the plane drawn and read back: what came back, or what is said to be lost."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.errors import MechdaeError
from mechdae.parts.exchange.drawings.dxf import dxf
from mechdae.parts.exchange.drawings.from_drawing import problem_of_drawing
from mechdae.tasks.motion_of import ExportedMotion
from tests.shared.exports import motion

CLOSE = 1e-9
"""How far a pose may be off, as a share of the drawing's size, whose lengths have 12 digits."""
ROWS = 9
NAMES = "TEXT on layer NAMES"


def lost(remarks: list[str]) -> list[str]:
    """Return what the reader of a drawing says that it did not read, but for names."""
    told = [text.partition(": ") for text in remarks if text.startswith(("not read", "not drawn"))]
    return [part for _, _, rest in told for part in rest.split(", ") if NAMES not in part]


def counts(mechanism: md.Mechanism) -> dict[str, int]:
    """Return numbers of bodies and of joints by kind, and the mobility by count."""
    found = {"bodies": len(mechanism.bodies), "mobility": 3 * len(mechanism.bodies)}
    for joint in mechanism.joints.values():
        found[joint.kind] = found.get(joint.kind, 0) + 1
        found["mobility"] -= {"weld": 3, "revolute": 2, "prismatic": 2}.get(joint.kind, 1)
    return found


def faults(found: dict[str, Any]) -> list[str]:
    """Return what is wrong with what became of a problem."""
    off = [f"off by {found[key]:.1e}" for key in ("off", "followed") if found.get(key, 0) > CLOSE]
    return [*found.get("faults", ()), *off]


def back(name: str, folder: Path, whole: ExportedMotion | None = None) -> dict[str, Any]:
    """Return what became of a problem of the plane that was drawn and read.

    ``lost`` is what is said to be lost, else ``off`` and ``followed`` are shares of the size that
    its pose, and poses of a sweep with the drivers of the problem, are off; ``faults`` what else
    differs.
    """
    whole = whole or motion(name)
    text = dxf(whole)[""]
    path = folder / f"{name}.dxf"
    path.write_text(text, encoding="utf-8")
    try:
        problem, remarks = problem_of_drawing(path)
    except MechdaeError as error:
        return {"lost": [f"{error.what}; {error.hint}"]}
    if told := lost(remarks):
        return {"lost": told}
    (pose,) = re.findall(r", pose (\d+)\n", text)
    return _Pair(whole, problem.mechanism, int(pose)).compared(remarks)


class _Pair:
    """A mechanism that was drawn in a pose, and the one read."""

    def __init__(self, whole: ExportedMotion, read: md.Mechanism, pose: int) -> None:
        self.whole, self.read, self.pose = whole, read, pose
        links = [name for name in read.bodies if name.startswith("link")]
        drawn = [name for name, own in whole.mechanism.bodies.items() if self._long(name, own)]
        self.links = dict(zip(links, drawn, strict=False))
        places = np.array([own.position[pose] for own in whole.result.points.values()])
        self.size = float(np.ptp(places, axis=0).max()) or 1.0

    def _long(self, name: str, body: md.Body) -> bool:
        """Whether a body has points in two places, and is drawn as lines."""
        values = self.whole.mechanism.values()
        return len({tuple(values[f"{name}.{p}.{a}"] for a in "xy") for p in body.points}) > 1

    def compared(self, remarks: list[str]) -> dict[str, Any]:
        before, after = counts(self.whole.mechanism), counts(self.read)
        found: dict[str, Any] = {"faults": [] if before == after else [f"{after} of {before}"]}
        free = after["mobility"]
        said = [text for text in remarks if text.startswith(("driver: ", "mobility by count "))]
        if len(said) != 1 or (said[0].startswith("mobility") and f" {free}:" not in said[0]):
            found["faults"].append(f"said of the mobility: {said}")
        if not found["faults"]:
            drivers = self._drivers()
            found |= {"drivers": list(drivers), "off": self._off(self._sketched(free), [self.pose])}
            if drivers:
                rows = self._rows()
                moved = {word: values[rows] for word, values in drivers.items()}
                found |= {"poses": len(rows), "followed": self._off(moved, rows)}
        return found

    def _rows(self) -> list[int]:
        """Return poses from that of the drawing onwards, or backwards, where all is assembled."""
        status = [str(own) for own in self.whole.result.status]
        runs = []
        for way in (1, -1):
            run = [self.pose]
            while 0 <= run[-1] + way < len(status) and status[run[-1] + way] == "ok":
                run.append(run[-1] + way)
            runs.append(run)
        return max(runs, key=len)[:ROWS]

    def _sketched(self, free: int) -> dict[str, Any]:
        """Return drivers of the mechanism read with their sketched values."""
        sketch, ground = self.read.sketch, []
        for joint in self.read.joints.values():
            if joint.kind == "prismatic":
                ground.append((f"{joint.name}.slide", 0.0))
        turns = [(f"{name}.angle", sketch[name]) for name in self.links]
        return {word: np.array([value]) for word, value in (turns + ground)[: max(free, 1)]}

    def _drivers(self) -> dict[str, Any]:
        """Return drivers of the mechanism read by all poses, empty where one has not come back."""
        result, found = self.whole.result, {}
        slides = [own.name for own in self.whole.mechanism.joints.values() if own.straight]
        guides = [own.name for own in self.read.joints.values() if own.kind == "prismatic"]
        for driver, own in result.drivers.items():
            values = np.asarray(own.position)
            for link, body in self.links.items():
                turned = np.asarray(result.bodies[body].angle)
                gap = values - turned - (values - turned)[self.pose]
                good = np.isfinite(gap)
                if good.any() and np.abs(gap[good]).max() < CLOSE:
                    found[f"{link}.angle"] = self.read.sketch[link] + turned - turned[self.pose]
                    break
            else:
                name, _, word = driver.partition(".")
                if word != "slide" or len(slides) != len(guides):
                    return {}
                found[f"{guides[slides.index(name)]}.slide"] = values - values[self.pose]
        return found

    def _off(self, drivers: dict[str, Any], rows: list[int]) -> float:
        """Return how far pins of the mechanism read are off those that were drawn."""
        moved = [md.Driver(word, at=[float(v) for v in at]) for word, at in drivers.items()]
        result = md.solve(self.read, md.Sweep(drivers=moved))
        if set(result.status) != {"ok"}:
            return math.inf
        worst = 0.0
        for link, body in self.links.items():
            known = [
                np.asarray(own.position)[rows]
                for key, own in self.whole.result.points.items()
                if key.startswith(f"{body}.")
            ]
            for point in self.read.bodies[link].points:
                track = result.points[f"{link}.{point}"].position
                near = min(known, key=lambda own: float(np.abs(own[0] - track[0]).max()))
                worst = max(worst, float(np.abs(near - track).max()))
        return worst / self.size
