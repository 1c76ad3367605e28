"""What wheels that drive each other add: the forces between them."""

from __future__ import annotations

from mechdae.additions import Added, Adds

ADDS: Adds = {"forces of joints": {"meshes": Added("mechdae.forces.teeth.real_pairs")}}
