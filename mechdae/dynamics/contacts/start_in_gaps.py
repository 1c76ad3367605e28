"""Where motions of joints in their gaps start."""

from __future__ import annotations

from dataclasses import replace

from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.start import Start, start
from mechdae.errors import InconsistentStartError


def start_in_gaps(setup: MotionProblem) -> Start:
    """Return the start with joints in the middle of their gaps if what is given agrees with that.

    Otherwise the pose of the sketch without gaps is moved to what is given.
    """
    closed = setup.closed_joints
    try:
        return start(closed)
    except InconsistentStartError:
        closed.task = replace(closed.task, start=None, start_speed=None)
        return start(setup, start(closed).q)
