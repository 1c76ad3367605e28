"""Derivatives of a block along curves, and the system of its singular poses.

Along X = x + x1 e + x2 e^2/2, Z = z + z1 e + z2 e^2/2 + z3 e^3/6 and U, which is like Z, the
block's residual f(e) = F(X, Z, U) has the derivatives f', f'', f''' at e = 0 that conditions
on higher derivatives of a branch are made of.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca

from mechdae.equations.reduction import Scene
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.types import Graph, Sym

SX = ca.SX


def jets(scene: Scene, graph: BlockGraph) -> Graph:
    """Return the function (x, x1, x2, z, .., z3, u, .., u3, p) -> F, J, f', f'', f'''."""
    e = SX.sym("e")
    x, x1, x2 = (SX.sym(name, graph.size) for name in ("x", "x1", "x2"))
    z, z1, z2, z3 = (SX.sym(name, len(graph.uses)) for name in ("z", "z1", "z2", "z3"))
    u, u1, u2, u3 = (SX.sym(name, scene.u.numel()) for name in ("u", "u1", "u2", "u3"))
    p = scene.model.p
    block = ca.Function("block", [graph.x, graph.z, scene.u, p], [graph.F, graph.J])
    Z = z + z1 * e + z2 * e**2 / 2 + z3 * e**3 / 6
    U = u + u1 * e + u2 * e**2 / 2 + u3 * e**3 / 6
    values = [block(x + x1 * e + x2 * e**2 / 2, Z, U, p)[0]]
    for _ in range(3):
        values.append(ca.jacobian(values[-1], e))
    values = [ca.densify(ca.substitute(value, e, 0)) for value in values]
    J = ca.densify(block(x, z, u, p)[1])
    inputs = [x, x1, x2, z, z1, z2, z3, u, u1, u2, u3, p]
    return ca.Function("jets", inputs, [values[0], J, *values[1:]])


def crossing(scene: Scene, graph: BlockGraph) -> Graph:
    """Return the system of the poses at which two branches of a block may cross.

    (y, z, z1, z2, u, u1, u2, p, columns, rows, mix) -> G, G_y with
    y = (x / columns, e, w / rows):
    F = 0, J^T w = 0, w . (F_z z' + F_u u') = 0 and w . w = 1, all scaled by the positive
    vectors `columns` and `rows`; e is the path parameter counted from where z and u are given.
    The m equations of a redundant block are mixed to n by the matrix `mix` (n m,).
    """
    n, nz, nu = graph.size, len(graph.uses), scene.u.numel()
    y = SX.sym("y", 2 * n + 1)
    z, z1, z2 = (SX.sym(name, nz) for name in ("z", "z1", "z2"))
    u, u1, u2 = (SX.sym(name, nu) for name in ("u", "u1", "u2"))
    p = scene.model.p
    columns, rows, mix, mixed = _scaling(graph)
    x, e, w = y[:n] * columns, y[n], y[n + 1 :]
    driven = ca.Function(
        "driven",
        [graph.x, graph.z, scene.u, p, graph.shape.vz, graph.shape.vu],
        [graph.F, graph.J, graph.drift],
    )
    ahead = [z + z1 * e + z2 * e**2 / 2, u + u1 * e + u2 * e**2 / 2]
    F, J, push = driven(x, *ahead, p, z1 + z2 * e if nz else z1, u1 + u2 * e)
    system = ca.vertcat(
        mixed(F / rows),
        mixed(ca.diag(1 / rows) @ J @ ca.diag(columns)).T @ w,
        ca.dot(w, mixed(push / rows)),
        ca.sumsqr(w) - 1,
    )
    inputs = [y, z, z1, z2, u, u1, u2, p, columns, rows, mix]
    return ca.Function("crossing", inputs, [ca.densify(system), ca.densify(ca.jacobian(system, y))])


def vertex(scene: Scene, graph: BlockGraph) -> Graph:
    """Return the system of a block's singular pose with a load e on its equations.

    (y, w0, z, u, p, columns, rows, mix) -> G, G_y with y = (x / columns, e, v / columns):
    F / rows = e w0, J v = 0 and v . v = 1; `mix` as in `crossing`.
    """
    n, nz, nu = graph.size, len(graph.uses), scene.u.numel()
    y, w0 = SX.sym("y", 2 * n + 1), SX.sym("w0", n)
    z, u, p = SX.sym("z", nz), SX.sym("u", nu), scene.model.p
    columns, rows, mix, mixed = _scaling(graph)
    block = ca.Function("block", [graph.x, graph.z, scene.u, p], [graph.F, graph.J])
    F, J = block(y[:n] * columns, z, u, p)
    v = y[n + 1 :]
    slope = mixed((J @ (columns * v)) / rows)
    system = ca.vertcat(mixed(F / rows) - y[n] * w0, slope, ca.sumsqr(v) - 1)
    inputs = [y, w0, z, u, p, columns, rows, mix]
    return ca.Function("vertex", inputs, [ca.densify(system), ca.densify(ca.jacobian(system, y))])


def _scaling(graph: BlockGraph) -> tuple[Sym, Sym, Sym, Callable[[Any], Any]]:
    """Return symbols of columns, rows and mix, and what mixes the equations of the block."""
    columns, rows = SX.sym("columns", graph.size), SX.sym("rows", graph.rows)
    if not graph.redundant:
        return columns, rows, SX(0, 1), lambda values: values
    mix = SX.sym("mix", graph.size * graph.rows)
    matrix = ca.reshape(mix, graph.size, graph.rows)
    return columns, rows, mix, lambda values: matrix @ values
