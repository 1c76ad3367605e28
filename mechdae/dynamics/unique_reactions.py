"""The reactions of a motion and which of them are unique, computed when one is read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechdae.dynamics.observe import Observer, States
from mechdae.dynamics.unique import Unique, dependence_note, unique
from mechdae.results import LazyPart, Series, Summary
from mechdae.types import Floats, Reactions


class Determined:
    """The reactions of a motion by joint, nan where they are not unique.

    `q` (n, nq): absolute coordinates at the states.
    """

    def __init__(self, observer: Observer, states: States, q: Floats) -> None:
        self.setup = observer.setup
        self.joints = list(self.setup.model.mechanism.joints)
        self._later = LazyPart(lambda: self._found(observer, states, q))

    @staticmethod
    def _found(observer: Observer, states: States, q: Floats) -> dict[str, Any]:
        multipliers = observer.multipliers(states)
        reactions = observer.reactions(states, multipliers)
        sole = unique(observer, states, q, reactions)
        for k, reaction in enumerate(reactions.values()):
            reaction[sole.lost[:, k]] = np.nan
        return {"multipliers": multipliers, "reactions": reactions, "sole": sole}

    @property
    def sole(self) -> Unique:
        """What is unique."""
        found: Unique = self._later.parts()["sole"]
        return found

    @property
    def reactions(self) -> dict[str, Reactions]:
        """Reactions (n, 3) by joint."""
        found: dict[str, Reactions] = self._later.parts()["reactions"]
        return found

    def series(self) -> dict[str, LazyPart]:
        """Return the reaction of each joint as an array to be read later."""
        return {joint: self._reaction(joint) for joint in self.joints}

    def _reaction(self, joint: str) -> LazyPart:
        return LazyPart(lambda: {"reaction": self.reactions[joint]})

    def unique(self) -> Summary:
        """Return what is unique of the other reactions by joint, to be read later."""
        return Summary(dict.fromkeys(self.joints, LazyPart(lambda: self.sole.joints)))

    def efforts(self) -> Series:
        """Return the efforts of the laws of coordinates, nan where they are not unique."""

        def found() -> dict[str, Floats]:
            return {
                row.owner: -multiplier if alone else np.full(len(multiplier), np.nan)
                for row, multiplier, alone in self._rows()
                if row.driver and row.part == "law"
            }

        rows = self.setup.released.rows
        names = [row.owner for row in rows if row.driver and row.part == "law"]
        return Series(dict.fromkeys(names, LazyPart(found)))

    def _rows(self) -> Any:
        """Return rows with their multipliers (n,) and whether those are unique at the end."""
        multipliers = self._later.parts()["multipliers"]
        return zip(self.setup.released.rows, multipliers.T, self.sole.multipliers, strict=True)

    def summary(
        self, forced: Mapping[str, float], superfluous: int, before: list[str], after: list[str]
    ) -> LazyPart:
        """Return multipliers at the end, what is not unique, and the notes."""

        def found() -> dict[str, Any]:
            sole, dependence = self.sole, list[str]()
            multipliers: dict[str, float | None] = dict(forced)
            known = {*forced, *(".".join(key) for key in self.setup.held)}
            for row, multiplier, alone in self._rows():
                if row.name not in known and self.setup.released.tells(row):
                    multipliers[row.name] = float(multiplier[-1]) if alone else None
            summary: dict[str, Any] = {"multipliers": multipliers, **sole.summary}
            if superfluous and sole.dependent:
                lost = sole.summary.get("not_unique", [])
                joints = [name for name in self.joints if name not in lost]
                redundant = {"equations": sole.dependent, "unique": joints, "not_unique": lost}
                summary["redundant"] = redundant
                dependence = [dependence_note(redundant)]
            if told := [*sole.notes, *before, *dependence, *after]:
                summary["notes"] = told
            return summary

        return LazyPart(found)
