"""Closed forms of the predefined mechanisms, dyad by dyad, in complex numbers.

An independent reference: numpy only, nothing of the package. Every mechanism is a function
of its driver's values ``u`` (rad) with the dimensions of the predefined file as keyword
defaults. It returns a dict from result names to arrays: ``"rod.B"`` is a complex position,
``"rod"`` a body's angle. The real type follows ``u`` (float64 or longdouble). Where a
mechanism does not assemble the values are nan.

The same functions accept a `Jet`, a truncated Taylor series in the driver; `derivatives`
uses it, so the rates are exact to rounding, not differenced.
"""

from __future__ import annotations

from functools import wraps
from math import factorial

import numpy as np

# --------------------------------------------------------------------------------------
# Truncated Taylor series


class Jet:
    """A truncated Taylor series with arrays as coefficients.

    Parameters
    ----------
    coefficients : sequence of ndarray
        ``coefficients[k]`` belongs to the k-th power of the increment.
    """

    __array_ufunc__ = None  # numpy arrays leave mixed operations to this class

    def __init__(self, coefficients):
        self.c = list(coefficients)

    @classmethod
    def variable(cls, u, order):
        """Return the independent variable at ``u``: u + 1 * increment."""
        return cls([u] + [np.full_like(u, float(k == 0)) for k in range(order)])

    def _lift(self, other):
        if isinstance(other, Jet):
            return other
        zero = np.zeros_like(self.c[0])
        return Jet([zero + other] + [zero] * (len(self.c) - 1))

    def __add__(self, other):
        return Jet([a + b for a, b in zip(self.c, self._lift(other).c, strict=True)])

    def __neg__(self):
        return Jet([-a for a in self.c])

    def __sub__(self, other):
        return self + (-other)

    def __rsub__(self, other):
        return -self + other

    def __mul__(self, other):
        if not isinstance(other, Jet):
            return Jet([a * other for a in self.c])
        a, b = self.c, other.c
        return Jet([sum(a[j] * b[k - j] for j in range(k + 1)) for k in range(len(a))])

    __radd__ = __add__
    __rmul__ = __mul__

    def __truediv__(self, other):
        if not isinstance(other, Jet):
            return Jet([a / other for a in self.c])
        quotient = []
        for k, a in enumerate(self.c):
            rest = a - sum(quotient[j] * other.c[k - j] for j in range(k))
            quotient.append(rest / other.c[0])
        return Jet(quotient)

    def __rtruediv__(self, other):
        return self._lift(other) / self

    def map(self, function):
        """Apply a real-linear function (real, imag, conj) to every coefficient."""
        return Jet([function(a) for a in self.c])


def real(z):
    """Real part of an array or a jet."""
    return z.map(np.real) if isinstance(z, Jet) else np.real(z)


def imag(z):
    """Imaginary part of an array or a jet."""
    return z.map(np.imag) if isinstance(z, Jet) else np.imag(z)


def conj(z):
    """Complex conjugate of an array or a jet."""
    return z.map(np.conj) if isinstance(z, Jet) else np.conj(z)


def unit(angle):
    """Unit vector exp(i angle)."""
    if not isinstance(angle, Jet):
        return np.cos(angle) + 1j * np.sin(angle)
    result = [np.cos(angle.c[0]) + 1j * np.sin(angle.c[0])]
    for k in range(1, len(angle.c)):
        terms = (j * angle.c[j] * result[k - j] for j in range(1, k + 1))
        result.append(1j * sum(terms) / k)
    return Jet(result)


def sqrt(x):
    """Real square root; nan for negative values, without a warning."""
    with np.errstate(invalid="ignore", divide="ignore"):
        if not isinstance(x, Jet):
            return np.sqrt(x)
        result = [np.sqrt(x.c[0])]
        for k in range(1, len(x.c)):
            rest = x.c[k] - sum(result[j] * result[k - j] for j in range(1, k))
            result.append(rest / (2 * result[0]))
    return Jet(result)


def arg(z, near=0.0):
    """Angle of ``z``: the representative within half a turn of the number ``near``."""
    first = z.c[0] if isinstance(z, Jet) else z
    turned = first * np.exp(-1j * first.real.dtype.type(near))
    value = np.arctan2(turned.imag, turned.real) + near
    if not isinstance(z, Jet):
        return value
    result, order = [value], len(z.c) - 1
    if order:  # angle' = Im(z' / z)
        slope = Jet([(k + 1) * z.c[k + 1] for k in range(order)]) / Jet(z.c[:order])
        result += [np.imag(s) / (k + 1) for k, s in enumerate(slope.c)]
    return Jet(result)


def length(z):
    """Length of a complex vector."""
    return sqrt(real(z * conj(z)))


def _quiet(function):
    """Let nan, the mark of a pose that does not assemble, pass without warnings."""

    @wraps(function)
    def quiet(*args, **kwargs):
        with np.errstate(invalid="ignore", divide="ignore"):
            return function(*args, **kwargs)

    return quiet


def _driver(u):
    """Return ``u`` as a jet or a floating array."""
    if isinstance(u, Jet):
        return u
    u = np.asarray(u)
    return u if u.dtype == np.longdouble else u.astype(np.float64)


# --------------------------------------------------------------------------------------
# Dyads


@_quiet
def circle_circle(c1, r1, c2, r2, sign):
    """Inner pin of an R-R-R dyad.

    Parameters
    ----------
    c1, c2 : complex array or Jet
        Outer pins.
    r1, r2 : float
        Distances of the inner pin from them.
    sign : {1, -1}
        +1: the inner pin lies left of the line from ``c1`` to ``c2``.

    Returns
    -------
    complex array or Jet
        The inner pin; nan where the circles do not meet.
    """
    line = c2 - c1
    square = real(line * conj(line))
    along = (square + (r1 - r2) * (r1 + r2)) / (2 * square)
    # Heron's product keeps its digits where the dyad is nearly stretched or folded
    across = sqrt(((r1 + r2) * (r1 + r2) - square) * (square - (r1 - r2) * (r1 - r2)))
    return c1 + line * (along + 1j * (sign * across / (2 * square)))


@_quiet
def circle_line(centre, radius, point, direction, sign):
    """Outer pin of an R-R-P dyad: a circle met by a straight guide.

    Parameters
    ----------
    centre : complex array or Jet
        Centre of the circle.
    radius : float
        Its radius.
    point, direction : complex
        A point of the guide and the unit vector along it.
    sign : {1, -1}
        +1: the intersection further along ``direction``.

    Returns
    -------
    position : complex array or Jet
        The intersection; nan where there is none.
    slide : array or Jet
        Its coordinate along the guide, from ``point``.
    """
    start = (centre - point) * np.conj(direction)
    off = imag(start)
    slide = real(start) + sign * sqrt((radius - off) * (radius + off))
    return point + slide * direction, slide


def slotted_link(pivot, pin):
    """Direction and slide of an R-P-R dyad whose guide passes through both pins.

    Returns
    -------
    direction : complex array or Jet
        Unit vector from ``pivot`` to ``pin``.
    slide : array or Jet
        Their distance.
    """
    slide = length(pin - pivot)
    return (pin - pivot) / slide, slide


def triangle(side, left, right):
    """Apex over the side from 0 to ``side``, on its left.

    Parameters
    ----------
    side, left, right : float
        The side, the distance of the apex from 0 and from ``side``.

    Returns
    -------
    complex
        The apex in the frame of the side.
    """
    x = (side**2 + left**2 - right**2) / (2 * side)
    return complex(x, (left**2 - x**2) ** 0.5)


# --------------------------------------------------------------------------------------
# Rates


def derivatives(function, u, order=2, **dimensions):
    """Return the results of a mechanism and their derivatives by the driver.

    Parameters
    ----------
    function : callable
        One of the mechanisms of this module.
    u : array_like
        Driver values.
    order : int
        Highest derivative.
    **dimensions
        Passed on.

    Returns
    -------
    list of dict
        ``result[k][name]`` is the k-th derivative, exact to rounding.
    """
    u = _driver(u)
    jets = function(Jet.variable(u, order), **dimensions)
    return [{name: jet.c[k] * factorial(k) for name, jet in jets.items()} for k in range(order + 1)]


def motion(function, u, speed, acceleration=0.0, **dimensions):
    """Return positions, velocities and accelerations in time.

    Parameters
    ----------
    function, u, **dimensions
        As for `derivatives`.
    speed, acceleration : float or array
        First and second time derivative of the driver.

    Returns
    -------
    tuple of dict
        Positions, velocities, accelerations.
    """
    value, first, second = derivatives(function, u, 2, **dimensions)
    velocity = {name: first[name] * speed for name in value}
    rate = {name: second[name] * speed**2 + first[name] * acceleration for name in value}
    return value, velocity, rate


# --------------------------------------------------------------------------------------
# Four-bars


@_quiet
def four_bar(u, a, b, c, d, px=0.0, py=0.0, sign=1, names=("crank", "coupler", "rocker")):
    """Four-bar A-B-C-D, A at the origin, D at ``(d, 0)``, coupler point P from B.

    Parameters
    ----------
    u : array_like or Jet
        Angle of the driving link AB.
    a, b, c, d : float
        AB, BC, CD, AD.
    px, py : float
        P in the frame of the coupler (origin B, x towards C).
    sign : {1, -1}
        +1: C lies left of the line from B to D.
    names : tuple of str
        Names of the driving link, the coupler and the driven link.

    Returns
    -------
    dict
        Points ``A, B, C, D, P`` of the bodies and the bodies' angles.
    """
    u = _driver(u)
    first, coupler, last = names
    pin_a, pin_d = 0 * unit(u), d + 0 * unit(u)
    pin_b = a * unit(u)
    pin_c = circle_circle(pin_b, b, pin_d, c, sign)
    along = (pin_c - pin_b) / b
    return {
        first: u,
        coupler: arg(along),
        last: arg(pin_c - pin_d, near=np.pi / 2 if sign > 0 else -np.pi / 2),
        f"{first}.A": pin_a,
        f"{first}.B": pin_b,
        f"{coupler}.B": pin_b,
        f"{coupler}.C": pin_c,
        f"{coupler}.P": pin_b + complex(px, py) * along,
        f"{last}.C": pin_c,
        f"{last}.D": pin_d,
    }


def four_bar_crank_rocker(u, a=0.04, b=0.12, c=0.08, d=0.1, px=0.06, py=0.04, sign=1):
    """Crank-rocker; parameters and results as `four_bar`."""
    return four_bar(u, a, b, c, d, px, py, sign)


def four_bar_double_rocker(u, a=0.08, b=0.07, c=0.06, d=0.12, px=0.035, py=0.02, sign=1):
    """Double rocker; results as `four_bar` with the bodies left, coupler, right."""
    return four_bar(u, a, b, c, d, px, py, sign, names=("left", "coupler", "right"))


def double_rocker_limits(a=0.08, b=0.07, c=0.06, d=0.12):
    """Limits of the driving link: coupler and driven link in one line, BD = b + c.

    Returns
    -------
    tuple of float
        From, to (rad).
    """
    end = np.arccos((a * a + d * d - (b + c) ** 2) / (2 * a * d))
    return -end, end


# --------------------------------------------------------------------------------------
# Slider-cranks, yoke


@_quiet
def slider_crank(u, r=0.1, l=0.3, e=0.0, sign=1):  # noqa: E741
    """Slider-crank O-B-C, guide along x at height ``e``.

    Parameters
    ----------
    u : array_like or Jet
        Crank angle.
    r, l, e : float
        Crank, rod, offset of the guide.
    sign : {1, -1}
        +1: slider on the side of +x.

    Returns
    -------
    dict
        Bodies ``crank, rod, slider``, points ``O, B, C``, slide of ``guide``.
    """
    u = _driver(u)
    pin_b = r * unit(u)
    pin_c, slide = circle_line(pin_b, l, complex(0, e), 1.0, sign)
    return {
        "crank": u,
        "rod": arg(pin_c - pin_b, near=0.0 if sign > 0 else np.pi),
        "slider": 0 * u,
        "crank.O": 0 * pin_b,
        "crank.B": pin_b,
        "rod.B": pin_b,
        "rod.C": pin_c,
        "slider.C": pin_c,
        "guide": slide,
    }


def slider_crank_offset(u, r=0.04, l=0.12, e=-0.02, sign=1):  # noqa: E741
    """Offset slider-crank; parameters and results as `slider_crank`."""
    return slider_crank(u, r, l, e, sign)


@_quiet
def scotch_yoke(u, r=0.05):
    """Scotch yoke, slot across the guide along x.

    Parameters
    ----------
    u : array_like or Jet
        Crank angle.
    r : float
        Crank OA.

    Returns
    -------
    dict
        Bodies ``crank, yoke``, points ``O, A, S``, slides of ``slot`` and ``guide``.
    """
    u = _driver(u)
    pin = r * unit(u)
    return {
        "crank": u,
        "yoke": 0 * u,
        "crank.O": 0 * pin,
        "crank.A": pin,
        "yoke.S": real(pin) + 0j * pin,
        "slot": imag(pin),
        "guide": real(pin),
    }


@_quiet
def whitworth_quick_return(u, OA=0.1, OG=0.05, GB=0.08, BC=0.25, sign=1):
    """Whitworth quick return: pivot G inside the crank circle, ram on the line through G.

    Parameters
    ----------
    u : array_like or Jet
        Crank angle.
    OA, OG, GB, BC : float
        Crank, distance of the pivots (G below O), arm of the slotted link, rod.
    sign : {1, -1}
        +1: ram on the side of +x.

    Returns
    -------
    dict
        Bodies ``crank, block, link, rod, ram``, their points, slides ``slot, guide``. The
        link's angle follows the crank without jumps.
    """
    u = _driver(u)
    pin_o = 0 * unit(u)
    pin_g = -1j * OG + pin_o
    pin_a = OA * unit(u)
    along, slot = slotted_link(pin_g, pin_a)
    pin_b = pin_g - GB * along  # the arm points away from the slot
    pin_c, slide = circle_line(pin_b, BC, -1j * OG, 1.0, sign)
    link = u + arg(along * conj(unit(u)))
    return {
        "crank": u,
        "block": link,
        "link": link,
        "rod": arg(pin_c - pin_b, near=0.0 if sign > 0 else np.pi),
        "ram": 0 * u,
        "crank.O": pin_o,
        "crank.A": pin_a,
        "block.A": pin_a,
        "link.G": pin_g,
        "link.B": pin_b,
        "rod.B": pin_b,
        "rod.C": pin_c,
        "ram.C": pin_c,
        "slot": slot,
        "guide": slide,
    }


# --------------------------------------------------------------------------------------
# Six bars and more

# directions about which the angles of the bodies stay within half a turn
WATT_NEAR = (1.4, 2.7)
JANSEN_NEAR = {
    "bar_j": 2.6, "upper": 1.6, "bar_k": -2.3, "bar_c": -1.6, "bar_f": -1.6, "lower": 3.1,
}  # fmt: skip


@_quiet
def watt_six_bar(
    u, a=0.03, b=0.09, c=0.08, d=0.1, ex=0.05, ey=0.08, fx=0.12, fy=-0.03, g=0.07, h=0.09,
    signs=(1, 1),
):  # fmt: skip
    """Watt's six-bar (Watt I): four-bar A-B-C-D, dyad E-G-F on coupler and rocker.

    Parameters
    ----------
    u : array_like or Jet
        Crank angle.
    a, b, c, d : float
        AB, BC, CD, AD.
    ex, ey, fx, fy : float
        E in the coupler (origin B, x to C), F in the rocker (origin D, x to C).
    g, h : float
        EG, FG.
    signs : tuple of int
        C left (+1) of B-D, G left of E-F.

    Returns
    -------
    dict
        Bodies ``crank, coupler, rocker, link, arm`` and their points.
    """
    result = four_bar(u, a, b, c, d, sign=signs[0])
    del result["coupler.P"]
    along = (result["coupler.C"] - result["coupler.B"]) / b
    across = (result["rocker.C"] - result["rocker.D"]) / c
    pin_e = result["coupler.B"] + complex(ex, ey) * along
    pin_f = result["rocker.D"] + complex(fx, fy) * across
    pin_g = circle_circle(pin_e, g, pin_f, h, signs[1])
    result.update({
        "link": arg(pin_g - pin_e, near=WATT_NEAR[0]),
        "arm": arg(pin_g - pin_f, near=WATT_NEAR[1]),
        "coupler.E": pin_e,
        "link.E": pin_e,
        "link.G": pin_g,
        "rocker.F": pin_f,
        "arm.F": pin_f,
        "arm.G": pin_g,
    })  # fmt: skip
    return result


@_quiet
def jansen_leg(
    u, a=0.038, b=0.0415, c=0.0393, d=0.0401, e=0.0558, f=0.0394, g=0.0367, h=0.0657,
    i=0.049, j=0.05, k=0.0619, l=0.0078, m=0.015, signs=(1, -1, 1),  # noqa: E741
):  # fmt: skip
    """Jansen's leg, crank at O, fixed pivot C to the left of it and below.

    Parameters
    ----------
    u : array_like or Jet
        Crank angle.
    a, l : float
        Horizontal and vertical distance of the fixed pivots.
    b, d, e : float
        Upper triangle C-B, C-D, B-D.
    c, j, k, f : float
        Bars C-E, A-B, A-E, D-F.
    g, h, i : float
        Lower triangle E-F, F-P, E-P; P is the foot.
    m : float
        Crank O-A.
    signs : tuple of int
        B left (+1) of A-C, E left of A-C, F left of D-E.

    Returns
    -------
    dict
        Bodies ``crank, bar_j, upper, bar_k, bar_c, bar_f, lower`` and their points.
    """
    u = _driver(u)
    pin_o = 0 * unit(u)
    pin_c = complex(-a, -l) + pin_o
    pin_a = m * unit(u)
    pin_b = circle_circle(pin_a, j, pin_c, b, -signs[0])
    pin_e = circle_circle(pin_a, k, pin_c, c, -signs[1])
    pin_d = pin_c + triangle(b, d, e) / b * (pin_b - pin_c)
    pin_f = circle_circle(pin_d, f, pin_e, g, -signs[2])
    foot = pin_e + triangle(g, i, h) / g * (pin_f - pin_e)
    return {
        "crank": u,
        "bar_j": arg(pin_b - pin_a, near=JANSEN_NEAR["bar_j"]),
        "upper": arg(pin_b - pin_c, near=JANSEN_NEAR["upper"]),
        "bar_k": arg(pin_e - pin_a, near=JANSEN_NEAR["bar_k"]),
        "bar_c": arg(pin_e - pin_c, near=JANSEN_NEAR["bar_c"]),
        "bar_f": arg(pin_f - pin_d, near=JANSEN_NEAR["bar_f"]),
        "lower": arg(pin_f - pin_e, near=JANSEN_NEAR["lower"]),
        "crank.O": pin_o,
        "crank.A": pin_a,
        "bar_j.A": pin_a,
        "bar_j.B": pin_b,
        "upper.C": pin_c,
        "upper.B": pin_b,
        "upper.D": pin_d,
        "bar_k.A": pin_a,
        "bar_k.E": pin_e,
        "bar_c.C": pin_c,
        "bar_c.E": pin_e,
        "bar_f.D": pin_d,
        "bar_f.F": pin_f,
        "lower.E": pin_e,
        "lower.F": pin_f,
        "lower.P": foot,
    }


@_quiet
def peaucellier(u, l=0.5, s=0.2, r=0.2):  # noqa: E741
    """Peaucellier's cell: B moves on the line x = (l**2 - s**2) / (2 r).

    Parameters
    ----------
    u : array_like or Jet
        Angle of the crank Q-P, Q at ``(r, 0)``.
    l, s, r : float
        Arms O-A, O-C; sides of the rhombus A-P-C-B; crank.

    Returns
    -------
    dict
        Bodies ``crank, arm_A, arm_C, bar_AP, bar_CP, bar_AB, bar_CB`` and their points.
    """
    u = _driver(u)
    pin_o = 0 * unit(u)
    pin_p = r + r * unit(u)
    pin_a = circle_circle(pin_o, l, pin_p, s, 1)
    pin_c = circle_circle(pin_o, l, pin_p, s, -1)
    pin_b = pin_a + pin_c - pin_p
    ends = {
        "crank": ("Q", r + pin_o, "P", pin_p),
        "arm_A": ("O", pin_o, "A", pin_a),
        "arm_C": ("O", pin_o, "C", pin_c),
        "bar_AP": ("A", pin_a, "P", pin_p),
        "bar_CP": ("C", pin_c, "P", pin_p),
        "bar_AB": ("A", pin_a, "B", pin_b),
        "bar_CB": ("C", pin_c, "B", pin_b),
    }
    near = {"bar_AP": -np.pi / 2, "bar_CP": np.pi / 2}
    result = {}
    for body, (name1, point1, name2, point2) in ends.items():
        result[body] = u if body == "crank" else arg(point2 - point1, near=near.get(body, 0.0))
        result[f"{body}.{name1}"] = point1
        result[f"{body}.{name2}"] = point2
    return result


@_quiet
def gorshkov_seven_link(
    u, OA=0.1716, OG=0.46790884005019448852, GB=0.8342, BC=0.5179, BE=0.54, EF=0.3013,
    OF=0.8727, signs=(1, 1),
):  # fmt: skip
    """Crank, slotted rod G-B, slider C, dyad B-E-F.

    Parameters
    ----------
    u : array_like or Jet
        Crank angle.
    OA, OG, GB, BC, BE, EF, OF : float
        Lengths; G at ``(0, -OG)``, F at ``(OF, 0)``, the guide of C is the x axis.
    signs : tuple of int
        C on the side of +x (+1), E left of B-F (+1).

    Returns
    -------
    dict
        Bodies of the predefined file, their points, slides ``slot, guide``.
    """
    u = _driver(u)
    pin_o = 0 * unit(u)
    pin_g, pin_f = -1j * OG + pin_o, OF + pin_o
    pin_a = OA * unit(u)
    along, slot = slotted_link(pin_g, pin_a)
    pin_b = pin_g + GB * along
    pin_c, slide = circle_line(pin_b, BC, 0j, 1.0, signs[0])
    pin_e = circle_circle(pin_b, BE, pin_f, EF, signs[1])
    rod = arg(along, near=np.pi / 2)
    return {
        "crank": u,
        "block": rod,
        "rod": rod,
        "connecting_rod": arg(pin_c - pin_b, near=0.0 if signs[0] > 0 else np.pi),
        "slider": 0 * u,
        "coupler": arg(pin_e - pin_b),
        "rocker": arg(pin_e - pin_f, near=np.pi / 2 if signs[1] > 0 else -np.pi / 2),
        "crank.O": pin_o,
        "crank.A": pin_a,
        "block.A": pin_a,
        "rod.G": pin_g,
        "rod.B": pin_b,
        "connecting_rod.B": pin_b,
        "connecting_rod.C": pin_c,
        "slider.C": pin_c,
        "coupler.B": pin_b,
        "coupler.E": pin_e,
        "rocker.F": pin_f,
        "rocker.E": pin_e,
        "slot": slot,
        "guide": slide,
    }


def gorshkov_limits(OA=0.1716, OG=0.46790884005019448852, GB=0.8342, BE=0.54, EF=0.3013, OF=0.8727):
    """Limits of the crank: B, E, F in one line, BF = BE + EF.

    B lies on the circle about G and on the circle about F; the crank angle follows from the
    direction of the rod.

    Returns
    -------
    tuple of float
        From, to (rad).
    """
    pin_g = -1j * OG
    pin_b = circle_circle(np.complex128(pin_g), GB, np.complex128(OF), BE + EF, 1)
    along = (pin_b - pin_g) / GB
    # A on the line through G: two crank positions
    ends = [circle_line(pin_g * 0, OA, pin_g, along, sign)[0] for sign in (-1, 1)]
    return float(np.angle(ends[0])), float(np.angle(ends[1]))


# --------------------------------------------------------------------------------------
# Gears


@_quiet
def geared_five_bar(u, l0=0.1, l1=0.048, l2=0.09, l3=0.08, i42=-1.0, sign=-1):
    """Crank-rocker whose coupler carries a planet wheel meshing with a wheel at A.

    The crank's angle is the root of ``u = i42 * coupler + (1 - i42) * crank``, unique for
    ``i42 < 0`` with the crank the shortest link (monotone): bisection, then Newton.

    Parameters
    ----------
    u : array_like or Jet
        Angle of the driving wheel.
    l0, l1, l2, l3 : float
        DA, AB, BC, CD.
    i42 : float
        Ratio seen from the crank, negative.
    sign : {1, -1}
        +1: C left of the line from D to B.

    Returns
    -------
    dict
        Bodies ``wheel, crank, coupler, rocker`` and their points.
    """
    u = _driver(u)
    if not i42 < 0:
        raise ValueError("i42 must be negative")

    def pins(crank):
        pin_b = l0 + l1 * unit(crank)
        pin_c = circle_circle(0 * pin_b, l3, pin_b, l2, sign)
        return pin_b, pin_c, arg(pin_b - pin_c)

    def rest(crank, wheel):
        return i42 * pins(crank)[2] + (1 - i42) * crank - wheel

    wheel = u.c[0] if isinstance(u, Jet) else u
    half = np.pi * abs(i42) / (1 - i42)
    low, high = wheel / (1 - i42) - half, wheel / (1 - i42) + half
    for _ in range(30):
        middle = (low + high) / 2
        above = rest(middle, wheel) > 0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    crank = (low + high) / 2
    for _ in range(3):
        value = rest(Jet.variable(crank, 1), wheel)
        crank = crank - value.c[0] / value.c[1]
    if isinstance(u, Jet):  # each step makes one more coefficient exact
        slope = rest(Jet.variable(crank, 1), wheel).c[1]
        crank = Jet([crank] + [np.zeros_like(crank) for _ in u.c[1:]])
        for _ in u.c[1:]:
            crank = crank - rest(crank, u) / slope
    pin_b, pin_c, coupler = pins(crank)
    pin_d, pin_a = 0 * pin_b, l0 + 0 * pin_b
    return {
        "wheel": u,
        "crank": crank,
        "coupler": coupler,
        "rocker": arg(pin_c - pin_d),
        "wheel.A": pin_a,
        "crank.A": pin_a,
        "crank.B": pin_b,
        "coupler.B": pin_b,
        "coupler.C": pin_c,
        "rocker.C": pin_c,
        "rocker.D": pin_d,
    }


@_quiet
def planetary_gear_train(u, z_s=24, z_p=18, z_r=60, m=0.002):
    """Planetary train, ring fixed, sun driven (Willis).

    Parameters
    ----------
    u : array_like or Jet
        Angle of the sun.
    z_s, z_p, z_r : int
        Numbers of teeth; ``z_r = z_s + 2 * z_p`` for coaxial wheels.
    m : float
        Module.

    Returns
    -------
    dict
        Bodies ``sun, planet, carrier, ring``, planet centre ``P``, a point ``T`` of its
        pitch circle.
    """
    u = _driver(u)
    carrier = u * z_s / (z_s + z_r)
    planet = carrier * (z_p - z_r) / z_p
    centre = m * (z_s + z_p) / 2 * unit(carrier)
    return {
        "sun": u,
        "planet": planet,
        "carrier": carrier,
        "ring": 0 * u,
        "sun.O": 0 * centre,
        "ring.O": 0 * centre,
        "carrier.O": 0 * centre,
        "carrier.P": centre,
        "planet.P": centre,
        "planet.T": centre + m * z_p / 2 * unit(planet),
    }


MECHANISMS = {
    "gorshkov-seven-link": gorshkov_seven_link,
    "geared-five-bar": geared_five_bar,
    "four-bar-crank-rocker": four_bar_crank_rocker,
    "four-bar-double-rocker": four_bar_double_rocker,
    "slider-crank": slider_crank,
    "slider-crank-offset": slider_crank_offset,
    "whitworth-quick-return": whitworth_quick_return,
    "scotch-yoke": scotch_yoke,
    "watt-six-bar": watt_six_bar,
    "jansen-leg": jansen_leg,
    "peaucellier": peaucellier,
    "planetary-gear-train": planetary_gear_train,
}
