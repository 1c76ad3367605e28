"""Plans: velocities, accelerations and forces of one pose as vector polygons to scale."""

from __future__ import annotations

from mechdae.draw.plans.picture import draw

__all__ = ["draw"]
