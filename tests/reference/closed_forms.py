"""Closed forms of the predefined mechanisms, dyad by dyad, in complex numbers.

An independent reference: numpy only, nothing of the package. Every mechanism is a function
of its driver's values ``u`` (rad) with the dimensions of the predefined file as keyword
defaults. It returns a dict from result names to arrays: ``"rod.B"`` is a complex position,
``"rod"`` a body's angle. The real type follows ``u`` (float64 or longdouble). Where a
mechanism does not assemble the values are nan.

The same functions accept a `Jet` of `jets`, whose `derivatives` gives their rates.
"""

from __future__ import annotations

import numpy as np

from tests.reference.jets import Jet, arg, conj, driver_of, imag, length, quietly, real, sqrt, unit

# --------------------------------------------------------------------------------------
# Dyads


@quietly
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


@quietly
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
# Four-bars


@quietly
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
    u = driver_of(u)
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


@quietly
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
    u = driver_of(u)
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


@quietly
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
    u = driver_of(u)
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


@quietly
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
    u = driver_of(u)
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


@quietly
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


@quietly
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
    u = driver_of(u)
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


@quietly
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
    u = driver_of(u)
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


@quietly
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
    u = driver_of(u)
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


@quietly
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
    u = driver_of(u)
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


@quietly
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
    u = driver_of(u)
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
