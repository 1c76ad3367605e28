"""Independent loops of steps between pins."""

from __future__ import annotations

from collections.abc import Sequence

Tree = dict[int, dict[int, int]]
"""By pin the steps {step: sign} that lead to it from the first one."""


def walk(steps: Sequence[tuple[int, int]]) -> tuple[Tree, list[dict[int, int]]]:
    """Return a tree of steps (from, to), and the loops {step: sign} that the other steps close."""
    tree: Tree = {steps[0][0]: {}} if steps else {}
    left, found = list(range(len(steps))), []
    while left:
        again = []
        for e in left:
            u, v = steps[e]
            if u in tree and v in tree:
                loop = dict(tree[u])
                loop[e] = loop.get(e, 0) + 1
                for other, sign in tree[v].items():
                    loop[other] = loop.get(other, 0) - sign
                found.append({other: sign for other, sign in loop.items() if sign})
            elif u in tree:
                tree[v] = {**tree[u], e: 1}
            elif v in tree:
                tree[u] = {**tree[v], e: -1}
            else:
                again.append(e)
        if len(again) == len(left):
            raise ValueError("the linkage falls apart")
        left = again
    return tree, found
