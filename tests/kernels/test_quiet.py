"""casadi's own warnings never reach the terminal, and nothing else is swallowed."""

from __future__ import annotations

import contextlib
import sys
from typing import Any

import casadi as ca
import numpy as np
import pytest

from mechdae.design.synthesis import ipopt
from mechdae.kernels.run.casadi_warnings import quiet


def overconstrained() -> None:
    """Build and solve a problem with more equations than variables."""
    x = ca.SX.sym("x")
    solver = ipopt.NlpSolver(x, ca.SX(0, 1), x**2, ca.vertcat(x, x - 1))
    zero = np.zeros(2)
    solver.solve(np.zeros(1), np.zeros(0), [-9.0], [9.0], zero, zero)


def test_an_overconstrained_problem_is_silent(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    overconstrained()
    assert capfd.readouterr() == ("", "")
    monkeypatch.setattr(ipopt, "quiet", contextlib.nullcontext)  # the mistake of old
    overconstrained()
    assert "overconstrained" in capfd.readouterr().err


def test_everything_else_passes(capsys: pytest.CaptureFixture[str]) -> None:
    with quiet():
        print('CasADi - 2026 WARNING("x")', file=sys.stderr)
        print("a message", file=sys.stderr)
        sys.stderr.write('CasADi - 2026 WARNING("y")\n')
        sys.stderr.write("another\n")
        sys.stderr.flush()
    assert capsys.readouterr().err == "a message\nanother\n"


def test_the_stream_is_put_back() -> None:
    before: Any = sys.stderr
    with pytest.raises(ValueError, match="lost"), quiet():
        raise ValueError("lost")
    assert sys.stderr is before
