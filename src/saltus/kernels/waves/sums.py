"""Template: waves on a leg, computed once for all quantities; what they add up to, and bounds."""

from saltus.kernels.lanes import fma, load, magnitude, select, splat, store
from saltus.kernels.trigonometry import sincos


@kernel
def move_to(leg, time, w):
    """The waves of a leg at a time since it began."""
    groups, work = w.sizes[GROUPS], w.work
    rate, at = 3 * groups * w.state[leg], 3 * groups * leg
    for g in range(groups):
        decay = exponential(load(w.rates, rate + g, LANES) * time)
        sine, cosine = sincos(load(w.rates, rate + groups + g, LANES) * time)
        a, b = load(w.amplitudes, at + g, LANES), load(w.amplitudes, at + groups + g, LANES)
        store(work, NOW * groups + g, decay * fma(a, cosine, -(b * sine)))
        store(work, (NOW + 1) * groups + g, decay * fma(a, sine, b * cosine))


@kernel
def bound_waves(leg, middle, half, w):
    """The waves of a leg that are slow in a part of it, with three derivatives, where it has its
    middle; and what is left out.
    """
    groups, work = w.sizes[GROUPS], w.work
    rate, at = 3 * groups * w.state[leg], 3 * groups * leg
    for g in range(groups):
        grows, turns = load(w.rates, rate + g, LANES), load(w.rates, rate + groups + g, LANES)
        speed = load(w.rates, rate + 2 * groups + g, LANES)
        most = exponential(fma(grows, middle, magnitude(grows) * half))
        size = load(w.amplitudes, at + 2 * groups + g, LANES) * most
        reach, nothing = speed * half, splat(0.0, LANES)
        slow = reach < splat(1.0, LANES)
        real = select(slow, load(work, NOW * groups + g, LANES), nothing)
        imaginary = select(slow, load(work, (NOW + 1) * groups + g, LANES), nothing)
        for order in range(4):
            store(work, (SLOW + 2 * order) * groups + g, real)
            store(work, (SLOW + 2 * order + 1) * groups + g, imaginary)
            real, imaginary = (
                fma(grows, real, -(turns * imaginary)),
                fma(grows, imaginary, turns * real),
            )
        store(work, SHARP * groups + g, size * speed * speed)
        one, square = splat(1.0, LANES), reach * reach
        left = square * square * (1.0 / 24.0)
        store(work, REST * groups + g, size * select(slow, left, one))
        left, size = square * reach * (1.0 / 6.0), size * speed
        store(work, (REST + 1) * groups + g, size * select(slow, left, one))
        left, size = 0.5 * square, size * speed
        store(work, (REST + 2) * groups + g, size * select(slow, left, one))


@inner
def seen(row, waves, w):
    """The real part of a quantity's sum of waves, whose parts stand in these rows of `work`."""
    groups, waves = w.sizes[GROUPS], waves * w.sizes[GROUPS]
    total = splat(0.0, LANES)
    for g in range(groups):
        total = fma(load(w.quantities, row + g, LANES), load(w.work, waves + g, LANES), total)
        b = load(w.quantities, row + groups + g, LANES)
        total = fma(-b, load(w.work, waves + groups + g, LANES), total)
    return sum_of(total, w.sums)


@inner
def bounded(row, sizes, w):
    """The sum of sizes of waves, which stand in these rows of `work`, times a quantity's."""
    groups, sizes = w.sizes[GROUPS], sizes * w.sizes[GROUPS]
    total = splat(0.0, LANES)
    for g in range(groups):
        size = load(w.quantities, row + 2 * groups + g, LANES)
        total = fma(size, load(w.work, sizes + g, LANES), total)
    return sum_of(total, w.sums)


@inner
def sum_of(lane, sums):
    """The sum of the numbers in a lane."""
    store(sums, 0, lane)
    return (sums[0, 0] + sums[0, 1]) + (sums[0, 2] + sums[0, 3])
