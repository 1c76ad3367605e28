"""The model of a mechanism by its dimension, and the Assur groups of a model."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING, TypeGuard

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.mechanism import Mechanism
from mechdae.equations.groups import Group, assur_groups
from mechdae.equations.model import Model, Row

if TYPE_CHECKING:
    from mechdae.equations.tree.tree_model import TreeModel


def is_tree(model: Model) -> TypeGuard[TreeModel]:
    """Say whether a model is a tree of joints in space."""
    return model.mechanism.dimension == 3


def model_of(
    mechanism: Mechanism, drivers: Sequence[NamedCoordinate] = (), free: Iterable[str] = ()
) -> Model:
    """Return the model of a mechanism with these drivers."""
    if mechanism.dimension == 3:
        from mechdae.equations.tree.tree_model import TreeModel

        return TreeModel(mechanism, drivers, free)
    return Model(mechanism, free=free)


def released_model(
    mechanism: Mechanism, named: Iterable[str] = (), free: Iterable[str] = ()
) -> Model:
    """Return the model of a mechanism without drivers, of which these joints are `named`."""
    if mechanism.dimension == 3:
        from mechdae.equations.tree.released_tree import ReleasedTree

        return ReleasedTree(mechanism, named, free)
    return Model(mechanism, free=free)


def groups_of(
    model: Model, rows: Sequence[Row], coarse: bool = False, out: Collection[str] = ()
) -> list[Group]:
    """Return the Assur groups of a model's rows in solve order; see `assur_groups`."""
    if is_tree(model):
        return model.groups(rows, coarse, out)
    return assur_groups(model, rows, coarse, out)
