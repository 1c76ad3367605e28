"""What contacts whose surfaces are given add: pressure, sliding speed, wear along a cycle."""

from __future__ import annotations

from mechdae.additions import Added, Adds

ADDS: Adds = {"measures of forces": {"face_width": Added("mechdae.forces.wear.wear:along")}}
