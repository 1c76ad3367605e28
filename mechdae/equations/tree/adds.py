"""What mechanisms in space add: their model."""

from __future__ import annotations

from mechdae.additions import Added, Adds

ADDS: Adds = {
    "model": {"space": Added("mechdae.equations.tree.tree_model:TreeModel")},
    "released model": {"space": Added("mechdae.equations.tree.released_tree:ReleasedTree")},
}
