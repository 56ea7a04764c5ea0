"""Template: the exponential of a lane."""

from saltus.kernels.lanes import fma, larger, nearest_integer, power_of_two, smaller

#: ln 2 as the sum of two doubles.
LN2_1, LN2_2 = 6.93147180369123816490e-01, 1.90821492927058770002e-10


@inner
def exponential(a):
    """e^a of a lane, a at most some 700, to about one ulp: 2^n e^r, |r| <= ln(2)/2."""
    n = nearest_integer(a * 1.4426950408889634)
    r = fma(-n, LN2_2, fma(-n, LN2_1, a))
    p = fma(r, 1.0 / 6227020800.0, 1.0 / 479001600.0)
    p = fma(p, r, 1.0 / 39916800.0)
    p = fma(p, r, 1.0 / 3628800.0)
    p = fma(p, r, 1.0 / 362880.0)
    p = fma(p, r, 1.0 / 40320.0)
    p = fma(p, r, 1.0 / 5040.0)
    p = fma(p, r, 1.0 / 720.0)
    p = fma(p, r, 1.0 / 120.0)
    p = fma(p, r, 1.0 / 24.0)
    p = fma(p, r, 1.0 / 6.0)
    p = fma(p, r, 0.5)
    p = fma(p * r, r, r) + 1.0
    return p * power_of_two(smaller(larger(n, -1000.0), 1000.0))
