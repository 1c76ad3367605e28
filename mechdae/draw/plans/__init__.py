"""Plans: velocities, accelerations and forces of one pose as vector polygons to scale."""

from mechdae.additions import lazy_names

__getattr__ = lazy_names({"mechdae.draw.plans.picture": "draw"})
