"""sin and cos of a lane, to about one ulp, and the exact phase of a harmonic after many periods.

Reduction by pi/2 in three parts (Cody & Waite 1980) with fused multiply-add, then the minimax
polynomials of fdlibm (Sun Microsystems 1993) on [-pi/4, pi/4].
"""

from __future__ import annotations

import math

from saltus.kernels.lanes import (
    any_lane,
    fma,
    is_odd,
    libm_cos,
    libm_sin,
    magnitude,
    nearest_integer,
    select,
    turned_half,
)
from saltus.kernels.marks import inner, kernel

#: pi/2 as the sum of three doubles.
HALF_PI_1, HALF_PI_2, HALF_PI_3 = 1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33
#: 2 pi as the sum of two doubles.
TWO_PI_1, TWO_PI_2 = 6.283185307179586, 2.4492935982947064e-16
#: |angle| above which the number of quarter turns times HALF_PI_3 matters; the C library is used
#: then.
LARGEST_ANGLE = 1.0e7

_S = (
    1.58969099521155010221e-10,
    -2.50507602534068634195e-08,
    2.75573137070700676789e-06,
    -1.98412698298579493134e-04,
    8.33333333332248946124e-03,
    -1.66666666666666324348e-01,
)
_C = (
    -1.13596475577881948265e-11,
    2.08757232129817482790e-09,
    -2.75573143513906633035e-07,
    2.48015872894767294178e-05,
    -1.38888888888741095749e-03,
    4.16666666666666019037e-02,
)
_S6, _S5, _S4, _S3, _S2, _S1 = _S
_C6, _C5, _C4, _C3, _C2, _C1 = _C


@inner
def sincos(angle):
    """Sine and cosine [-] of a lane of angles [rad]."""
    n = nearest_integer(angle * (2.0 / math.pi))
    r = fma(-n, HALF_PI_3, fma(-n, HALF_PI_2, fma(-n, HALF_PI_1, angle)))
    z = r * r
    p = fma(fma(fma(fma(fma(_S6, z, _S5), z, _S4), z, _S3), z, _S2), z, _S1)
    sine = fma(r * z, p, r)
    q = fma(fma(fma(fma(fma(_C6, z, _C5), z, _C4), z, _C3), z, _C2), z, _C1)
    half = 0.5 * z
    w = 1.0 - half
    cosine = w + fma(z * z, q, (1.0 - w) - half)
    # quarter turns exchange sine and cosine
    odd = is_odd(n)
    s, c = select(odd, cosine, sine), select(odd, sine, cosine)
    s, c = turned_half(s, n), turned_half(c, n + 1.0)
    large = magnitude(angle) > LARGEST_ANGLE
    if any_lane(large):
        s, c = select(large, libm_sin(angle), s), select(large, libm_cos(angle), c)
    return s, c


@kernel
def two_product(a, b):
    """``a*b`` as a sum of two doubles (Dekker 1971; no fused multiply-add needed)."""
    p = a * b
    t = 134217729.0 * a
    ah = t - (t - a)
    t = 134217729.0 * b
    bh = t - (t - b)
    al, bl = a - ah, b - bh
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


@kernel
def turned(rate, period, count):
    """Phase [rad] in [-pi, pi] that a harmonic of angular frequency ``rate`` [rad/s] has gained
    after ``count`` periods [s].

    Zero if the period holds a whole number of its cycles (to 4 ulp): that is what a harmonic of the
    forcing means, whatever the rounding of 1/f. Else the fraction of a turn is carried in two
    doubles, so the phase is right to 1e-13 after 1e6 periods.
    """
    high, low = two_product(rate, period)
    turns = high / TWO_PI_1
    if abs(turns - round(turns)) <= 4.0 * 2.220446049250313e-16 * abs(turns):
        return 0.0
    back, back_low = two_product(turns, TWO_PI_1)
    # turns + rest is the quotient to 32 digits
    rest = ((high - back) - back_low + low - turns * TWO_PI_2) / TWO_PI_1
    whole, fraction = two_product(turns, float(count))
    gained = ((whole - round(whole)) + fraction) + rest * count
    return (gained - round(gained)) * TWO_PI_1
