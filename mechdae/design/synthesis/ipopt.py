"""The one place where IPOPT is called and its status is read."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.run.casadi_warnings import quiet
from mechdae.records import dataclass
from mechdae.types import Floats, Sym, Unknowns

SETTINGS: dict[str, Any] = {
    "expand": True,
    "print_time": False,
    "error_on_fail": False,
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.mu_strategy": "adaptive",
    "ipopt.tol": 1e-9,
    "ipopt.constr_viol_tol": 1e-10,
    "ipopt.max_iter": 250,
}
POLISH: dict[str, Any] = {
    "ipopt.tol": 1e-12,
    "ipopt.bound_relax_factor": 0.0,
    "ipopt.max_iter": 200,
    "ipopt.mu_init": 1e-7,
    "ipopt.mu_strategy": "monotone",
    "ipopt.warm_start_init_point": "yes",
    "ipopt.warm_start_bound_push": 1e-9,
    "ipopt.warm_start_mult_bound_push": 1e-9,
}
APPROXIMATE: dict[str, Any] = {
    "ipopt.hessian_approximation": "limited-memory",
    "ipopt.max_iter": 200,
}
BENT: dict[str, Any] = {
    "ipopt.limited_memory_update_type": "sr1",
    "ipopt.acceptable_tol": 1e8,
    "ipopt.acceptable_obj_change_tol": 1e-8,
    "ipopt.acceptable_iter": 3,
    "ipopt.acceptable_constr_viol_tol": 1e-9,
    "ipopt.acceptable_compl_inf_tol": 1e-6,
}
"""Where the objective bends down, and may have kinks, at which no gradient vanishes: the end is
where it changes no more."""
SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
EXHAUSTED = ("Maximum_Iterations_Exceeded", "Maximum_CpuTime_Exceeded")
INFEASIBLE = ("Infeasible_Problem_Detected",)
ALONE = threading.RLock()
"""Held while casadi builds or solves: neither it nor MUMPS may be entered by two threads."""


@dataclass(frozen=True)
class Optimum:
    """What one call gave.

    ``status`` is IPOPT's own word; ``solved`` and ``infeasible`` are read from it here and
    nowhere else. ``violation`` is the largest violation of a constraint or bound at ``z``.
    """

    z: Floats
    objective: float
    violation: float
    status: str
    iterations: int
    seconds: float
    bound_prices: Floats
    prices: Floats

    @property
    def solved(self) -> bool:
        """IPOPT says that it is optimal."""
        return self.status in SOLVED

    @property
    def exhausted(self) -> bool:
        """IPOPT ran out of iterations: it says nothing about the problem."""
        return self.status in EXHAUSTED

    @property
    def infeasible(self) -> bool:
        """IPOPT says that no point near satisfies the constraints."""
        return self.status in INFEASIBLE


class NlpSolver:
    """An NLP min f(z; p) with bounds on z and g, built once.

    `approximate`: second derivatives from the last gradients: where exact ones cost much or
    mislead. `bent`: with kinks: the end is where the objective changes no more.
    """

    def __init__(
        self, z: Sym, p: Sym, f: Sym, g: Sym, polish: bool = False, approximate: bool = False,
        bent: bool = False,
    ) -> None:  # fmt: skip
        options = {**SETTINGS, **(POLISH if polish else {})}
        options |= {**(APPROXIMATE if approximate else {}), **(BENT if bent else {})}
        options["expand"] = not isinstance(z, ca.MX)
        with quiet():
            self._solver = ca.nlpsol("nlp", "ipopt", {"x": z, "p": p, "f": f, "g": g}, options)
        self._values = ca.Function("values", [z, p], [f, g])

    def value(self, z: Unknowns, p: Floats) -> float:
        """Return the objective at a point."""
        return float(self._values(z, p)[0])

    def solve(
        self,
        z0: Unknowns,
        p: Floats,
        low: Floats | list[float],
        high: Floats | list[float],
        g_low: Floats,
        g_high: Floats,
        prices: tuple[Floats, Floats] | None = None,
    ) -> Optimum:
        """Return the local optimum from a start, and from `prices` of bounds and constraints."""
        begin = {} if prices is None else {"lam_x0": prices[0], "lam_g0": prices[1]}
        started = time.process_time()
        with ALONE, quiet(), _interruptible():
            found = self._solver(x0=z0, p=p, lbx=low, ubx=high, lbg=g_low, ubg=g_high, **begin)
            stats = self._solver.stats()
        seconds = time.process_time() - started
        z = np.clip(np.array(found["x"]).ravel(), low, high)
        f, g = (np.array(part).ravel() for part in self._values(z, p))
        outside = np.maximum(np.maximum(g_low - g, g - g_high), 0.0)
        return Optimum(
            z,
            float(f[0]),
            float(outside.max(initial=0.0)) if np.isfinite(g).all() else np.inf,
            str(stats["return_status"]),
            int(stats["iter_count"]),
            seconds,
            np.array(found["lam_x"]).ravel(),
            np.array(found["lam_g"]).ravel(),
        )


@contextmanager
def _interruptible() -> Iterator[None]:
    """Raise KeyboardInterrupt after a solve in which it came.

    casadi takes Ctrl-C for a failed evaluation and goes on: the start would count as finished.
    The first one waits for the end of the solve, a second one breaks it off.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    pressed: list[int] = []

    def note(number: int, frame: Any) -> None:
        pressed.append(number)
        if len(pressed) > 1:
            before(number, frame)

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed:
        raise KeyboardInterrupt
