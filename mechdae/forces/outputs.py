"""Named outputs that use forces, at the poses of a task and where it looks for them between."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechdae.describe.named import COMPONENTS
from mechdae.describe.tasks.motion import Reactions
from mechdae.errors import InputError
from mechdae.forces.poses import LoadedRun, PoseForces, solved
from mechdae.forces.series import efforts_of, series_of
from mechdae.forces.uniqueness import uniqueness
from mechdae.motion.kinematics import finds
from mechdae.results import Named, Series, SweepResult
from mechdae.types import Booleans, Floats, Json


def with_outputs(
    loaded: LoadedRun,
    result: SweepResult,
    task: Reactions,
    answer: PoseForces,
    joints: Mapping[str, Mapping[str, Floats]],
    efforts: Series,
) -> tuple[Named, list[Json], list[str]]:
    """Return the outputs of a task with those that use forces, what it looks for, and notes."""
    setting, run = loaded.setting, loaded.run
    expressions = setting.expressions
    assert expressions is not None
    time = None if loaded.moving.slow else setting.plan.time_of(run.values)
    values, notes = _values(loaded, run.poses.y, time, joints, efforts, answer.standing)
    outputs = expressions.reported({**dict(result.outputs), **values})
    sought = finds.sought(task, expressions.forced)
    if not sought:
        return outputs, [], notes

    def of(text: str) -> finds.Values:
        def value(s: Floats) -> tuple[Floats, Floats, Floats]:
            poses = finds.at_places(setting, run, s)
            motion = loaded.moving.at(s)
            there = poses.alive.all(axis=1) & ~poses.uncertain & motion.there
            forces = solved(loaded.statics, motion, there, critical=False)
            forces.leave_out(~there | forces.ambiguous)
            unique = uniqueness(loaded.statics, motion)
            series = series_of(loaded.statics, forces, task, unique)
            listed, _ = efforts_of(setting, loaded.statics, forces, task)
            time = None if loaded.moving.slow else finds.times(setting, run, s)
            got, _ = _values(loaded, poses.y, time, series, listed, forces.standing)
            return got[text].value, poses.condition, poses.places

        return value

    events, unmet = finds.located(sought, setting, run, of)
    return outputs, events, notes + unmet


def _values(
    loaded: LoadedRun,
    y: list[Floats],
    time: Floats | None,
    joints: Mapping[str, Mapping[str, Floats]],
    efforts: Series,
    certified: Booleans,
) -> tuple[dict[str, Series], list[str]]:
    """Return the outputs that use forces at poses with outputs `y` of coordinates and rates."""
    setting = loaded.setting
    expressions, mechanism = setting.expressions, setting.scene.model.mechanism
    assert expressions is not None
    columns = setting.outputs.columns(expressions.coordinates)
    there = [array[:, columns] for array in y[: expressions.derivatives + 1]]

    def force(word: str, owner: str, axis: str) -> Floats:
        if word == "effort":
            return np.asarray(efforts[owner])
        series = joints.get(owner, {})
        if word == "reaction" and word in series:
            return series[word][:, COMPONENTS[mechanism.dimension].index(axis)]
        if word in series:
            return series[word]
        if word == "loss":
            return np.zeros(len(certified))
        raise InputError(f"joint {owner} has no {word} in this task", where="outputs")

    return expressions.with_forces(there, time, force, certified)
