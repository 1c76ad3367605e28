"""Sizes of steps that all paths share, and what a path does at a change point that is none."""

from __future__ import annotations

NODES_PER_TURN = 128
"""Certified steps of a path in one turn of the driver, at least."""
ZONE = 0.35
"""Distance from the crossing at which its expansion takes over, in largest steps."""
PASS = "pass"
"""What a path does at branches that nearly meet, and do not for the numbers given."""
