"""The model of a mechanism by its dimension, and the Assur groups of a model."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.mechanism import Mechanism
from mechdae.model.groups import Group, assur_groups
from mechdae.model.model import Model, Row
from mechdae.model.tree.tree_model import TreeModel


def model_of(
    mechanism: Mechanism, drivers: Sequence[NamedCoordinate] = (), free: Iterable[str] = ()
) -> Model:
    """Return the model of a mechanism with these drivers."""
    if mechanism.dimension == 3:
        return TreeModel(mechanism, drivers, free)
    return Model(mechanism, free=free)


def groups_of(model: Model, rows: Sequence[Row], coarse: bool = False) -> list[Group]:
    """Return the Assur groups of a model's rows in solve order; see `assur_groups`."""
    if isinstance(model, TreeModel):
        return model.groups(rows, coarse)
    return assur_groups(model, rows, coarse)
