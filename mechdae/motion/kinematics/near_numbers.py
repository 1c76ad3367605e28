"""Parameters of a mechanism with a few other numbers, without building it again.

Only where these numbers change nothing but the values of parameters: not its structure, its sketch
or its drivers. Everything else is left to `Problem.with_values`, and so is every refusal.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mechdae.describe.expression import evaluate, names_in
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.tasks.kinds import Sweep
from mechdae.describe.values import Number
from mechdae.equations.model import Model
from mechdae.errors import MechdaeError


class NearNumbers:
    """What some numbers of a mechanism change.

    Parameters
    ----------
    model
        Symbols of the mechanism, which is planar.
    task
        Its drivers.
    names
        The numbers that change.

    Attributes
    ----------
    usable : bool
        Whether they change values of parameters only.
    """

    def __init__(self, model: Model, task: Sweep, names: Iterable[str]) -> None:
        mechanism = self.mechanism = model.mechanism
        self.names, self._base = tuple(names), dict(mechanism.parameter_values)
        self._numbers = dict(mechanism.numbers())
        self._changed = set(self.names)
        self._parameters = self._expressions(mechanism)
        self._expressed = [
            (name, number)
            for name, number in self._numbers.items()
            if isinstance(number, str) and names_in(number) & self._changed
        ]
        self._changed |= {name for name, _ in self._expressed}
        self._p, places = model.p_values, {name: i for i, name in enumerate(model.p_names)}
        self._places = [(name, places[name]) for name in self._changed if name in places]
        joints = mechanism.joints.values()
        self._joints = [(joint, touched) for joint in joints if (touched := self._touched(joint))]
        self._links = [
            pins for name in mechanism.bodies for pins in self._pins(mechanism, name) if pins
        ]
        self.usable: bool = all(name in places for name in self.names) and self._alone(
            mechanism, task
        )

    def _expressions(self, mechanism: Mechanism) -> list[tuple[str, str]]:
        """Return parameters that are expressions of what changes, each after those it needs."""
        found: list[tuple[str, str]] = []
        left = {n: text for n, text in mechanism.parameters.items() if isinstance(text, str)}
        while True:
            ready = [n for n, text in left.items() if names_in(text) & self._changed]
            ready = [n for n in ready if not names_in(left[n]) & (left.keys() - {n})] or ready
            if not ready:
                return found
            found.append((ready[0], str(left.pop(ready[0]))))
            self._changed.add(ready[0])

    def _touched(self, joint: Joint) -> dict[str, str]:
        """Return the numbers of a joint by their entries, none where no one changes."""
        names = {entry: f"{joint.name}.{entry}" for entry, _ in joint.numbers()}
        return names if self._changed.intersection(names.values()) else {}

    def _pins(self, mechanism: Mechanism, body: str) -> list[tuple[list[str], list[str]]]:
        """Return the coordinates of pairs of pins of a body that change."""
        hinges = [joint for joint in mechanism.joints.values() if joint.hinge]
        sides = {side for joint in hinges for side in (joint.first, joint.second)}
        references = sorted(side for side in sides if side.split(".")[0] == body != GROUND)
        places = [[f"{pin}.{axis}" for axis in mechanism.axes] for pin in references]
        return [
            (first, second)
            for k, first in enumerate(places)
            for second in places[:k]
            if self._changed.intersection((*first, *second))
        ]

    def _alone(self, mechanism: Mechanism, task: Sweep) -> bool:
        """Return whether nothing changes but the values of parameters."""
        literal = {**mechanism.parameters, **self._numbers}
        if any(isinstance(literal[n], str) or n.startswith("loads.") for n in self.names):
            return False
        if any(joint.meshes or joint.on_curve for joint, _ in self._joints):
            return False
        if any(name.split(".")[1] in ("mass", "inertia") for name, _ in self._expressed):
            return False
        asked: list[Any] = [*mechanism.sketch.values()]
        for driver in task.all_drivers:
            asked += [driver.from_, driver.to, *(driver.at or ())]
            asked += [driver.speed, driver.acceleration, driver.jerk]
        return not any(
            isinstance(number, str) and names_in(number) & self._changed for number in asked
        )

    def __call__(self, numbers: Mapping[str, Number]) -> Any:
        """Return the parameters (np,), None where they are another structure's or no mechanism's.

        `numbers` are those of `names`, in SI units.
        """
        known, values = dict(self._base), self._values(numbers)
        if values is None:
            return None
        try:
            known.update((n, v) for n, v in values.items() if n in known)
            for name, text in self._parameters:
                known[name] = values[name] = evaluate(text, known)
            for name, text in self._expressed:
                values[name] = evaluate(text, known)
            base = self.mechanism.values() if self._joints or self._links else {}
            every = base | values
            for joint, touched in self._joints:
                joint.check({entry: every[name] for entry, name in touched.items()})
        except MechdaeError:
            return None
        for first, second in self._links:
            if all(every[a] == every[b] for a, b in zip(first, second, strict=True)):
                return None
        p = self._p.copy()
        for name, place in self._places:
            p[place] = values[name]
        return p

    def _values(self, numbers: Mapping[str, Number]) -> dict[str, float] | None:
        """Return the numbers as floats, None where one is none, or is zero or of another sign."""
        values: dict[str, float] = {}
        for name in self.names:
            number = numbers[name]
            if type(number) is not float and not isinstance(number, (float, int, np.number)):
                return None
            value = values[name] = float(number)
            if not math.isfinite(value) or (name in self._numbers and not self._like(name, value)):
                return None
        return values

    def _like(self, name: str, value: float) -> bool:
        """Return whether a number has the sign that it has in the mechanism."""
        number = self._numbers[name]
        return not isinstance(number, str) and number * value > 0
