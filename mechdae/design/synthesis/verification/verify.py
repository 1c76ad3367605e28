"""What a design's own file does of what was asked: one measurement for each kind of goal."""

from __future__ import annotations

from collections.abc import Mapping
from types import ModuleType

from mechdae.describe.tasks.goals import (
    FunctionTargets,
    Maximise,
    Minimise,
    Rocker,
    StraightLine,
    Visits,
)
from mechdae.design.synthesis.verification import functions, lines, quantities, rockers, visits
from mechdae.design.synthesis.verification.claims import Claim, Stated, Worth
from mechdae.design.synthesis.verification.design_file import DesignFile

KINDS: Mapping[type, ModuleType] = {
    Visits: visits,
    FunctionTargets: functions,
    StraightLine: lines,
    Rocker: rockers,
    Minimise: quantities,
    Maximise: quantities,
}


def measured(stated: Stated, claim: Claim, design: DesignFile) -> Worth:
    """Return what the file of a design does of a goal or a limit."""
    found: Worth = KINDS[type(stated.asked)].measured(stated, claim, design)
    return found
