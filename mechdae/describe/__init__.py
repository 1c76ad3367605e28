"""Descriptions: mechanisms, tasks and problem files as frozen values, no computation.

What parts need most of this room is imported from here, each name when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdae.additions import lazy_names

if TYPE_CHECKING:
    from mechdae.describe.coordinates import coordinate
    from mechdae.describe.file.atomic_write import whole_file
    from mechdae.describe.file.load import load
    from mechdae.describe.file.problem import Problem
    from mechdae.describe.file.writing import dumps
    from mechdae.describe.joints.joint import Joint
    from mechdae.describe.mechanism import GROUND, Body, Ground, Mechanism
    from mechdae.describe.tasks.kinds import Driver, Sweep, Task
    from mechdae.describe.values import Table

__all__ = [
    "GROUND", "Body", "Driver", "Ground", "Joint", "Mechanism", "Problem", "Sweep", "Table", "Task",
    "coordinate", "dumps", "load", "whole_file",
]  # fmt: skip
__getattr__ = lazy_names(
    {
        "mechdae.describe.coordinates": "coordinate",
        "mechdae.describe.file.atomic_write": "whole_file",
        "mechdae.describe.file.load": "load",
        "mechdae.describe.file.problem": "Problem",
        "mechdae.describe.file.writing": "dumps",
        "mechdae.describe.joints.joint": "Joint",
        "mechdae.describe.mechanism": "GROUND Body Ground Mechanism",
        "mechdae.describe.values": "Table",
        "mechdae.describe.tasks.kinds": "Driver Sweep Task",
    }
)
