"""Turning bodies in closed form, 30 digits: the heavy symmetric top, and Euler's free body.

Landau and Lifshitz, Mechanics, 35 and 37; roots of the cubic, Jacobi's functions, a quadrature.
"""

from __future__ import annotations

import mpmath as mp

DIGITS = 30


def top(
    across: float, axial: float, moment: float, tilt: float, speeds: tuple[float, float], t: float
) -> tuple[float, float]:
    """Return cosine of the tilt and precession of a top that starts with its tilt at rest.

    Parameters
    ----------
    across, axial
        Moments of inertia about the fixed point.
    moment
        Weight times the distance of its centre.
    tilt
        Between the axis and the vertical at t = 0.
    speeds
        Rate of precession at t = 0, and the spin (component of the angular velocity on the axis).
    """
    with mp.workdps(DIGITS):
        A, C, mgl, u0 = (mp.mpf(own) for own in (across, axial, moment, mp.cos(mp.mpf(tilt))))
        rate, spin = map(mp.mpf, speeds)
        L3 = C * spin
        Lz = A * (1 - u0**2) * rate + L3 * u0
        E = A * (1 - u0**2) * rate**2 / 2 + mgl * u0
        # u'^2 = (1 - u^2) 2 (E - mgl u) / A - ((Lz - L3 u) / A)^2
        k = 2 * mgl / A
        b, c = -2 * E / A - L3**2 / A**2, -k + 2 * Lz * L3 / A**2
        b = b + k * u0  # one root of the cubic is the start, where the tilt rests
        c = c + b * u0
        root = mp.sqrt(b * b - 4 * k * c)
        u1, u2, u3 = sorted([u0, (-b - root) / (2 * k), (-b + root) / (2 * k)])
        m = (u2 - u1) / (u3 - u1)
        w = mp.sqrt(k * (u3 - u1)) / 2
        begin = mp.ellipk(m) if abs(u0 - u2) < abs(u0 - u1) else mp.mpf(0)

        def u(time: mp.mpf) -> mp.mpf:
            return u1 + (u2 - u1) * mp.ellipfun("sn", begin + w * time, m=m) ** 2

        def turning(time: mp.mpf) -> mp.mpf:
            return (Lz - L3 * u(time)) / (A * (1 - u(time) ** 2))

        half = mp.ellipk(m) / w
        ends = [mp.mpf(0), *[half * j for j in range(1, int(t / half) + 1)], mp.mpf(t)]
        return float(u(mp.mpf(t))), float(mp.quad(turning, ends))


def free_body(moments: tuple[float, float, float], w: tuple[float, float], t: float) -> list[float]:
    """Return the angular velocity in the body's axes, which starts as (w1, 0, w3).

    I1 < I2 < I3, and the square of the momentum above 2 E I2.
    """
    with mp.workdps(DIGITS):
        I1, I2, I3 = map(mp.mpf, moments)
        a, c = map(mp.mpf, w)
        E2, L2 = I1 * a**2 + I3 * c**2, I1**2 * a**2 + I3**2 * c**2
        assert L2 > E2 * I2
        rate = mp.sqrt((I3 - I2) * (L2 - E2 * I1) / (I1 * I2 * I3))
        m = (I2 - I1) * (E2 * I3 - L2) / ((I3 - I2) * (L2 - E2 * I1))
        b = mp.sqrt((E2 * I3 - L2) / (I2 * (I3 - I2)))
        cn, sn, dn = (mp.ellipfun(own, rate * mp.mpf(t), m=m) for own in ("cn", "sn", "dn"))
        return [float(a * cn), float(b * sn), float(c * dn)]
