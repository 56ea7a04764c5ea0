"""Template: ode15s, numerical differentiation formulas of orders 1 to 5 with backward differences,
in steps of constant length for a while, with the Jacobian of the equation.

Shampine & Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18 (1997) 1-22: formulas of order k
are BDF with kappa_k of the difference of order k + 1 added, solved by simplified Newton iterations.

Symbols
-------
k order; D_j backward differences of the state, in the rows after K1; psi what the formula knows
before the iteration; d the difference of order k + 1 that it looks for; G_k = 1 + 1/2 + ... + 1/k;
J the Jacobian, held until iterations are slow; theta = AbsTol/RelTol; length the step asked for.
Arrays count from 1, as in the paper.
"""

MOST_ORDER = 5
MOST_ITERATIONS = 4
EPSILON = 2.220446049250313e-16
GAMMAS = (0.0, 1.0, 3 / 2, 11 / 6, 25 / 12, 137 / 60)
KAPPAS = (0.0, -37 / 200, -1 / 9, -0.0823, -0.0415, 0.0)
#: 1/(G_k (1 - kappa_k)), and the error constants kappa_k G_k + 1/(k + 1).
INVERSES = (0.0, *(1.0 / (GAMMAS[j] * (1.0 - KAPPAS[j])) for j in range(1, 6)))
CONSTANTS = (0.0, *(KAPPAS[j] * GAMMAS[j] + 1.0 / (j + 1) for j in range(1, 6)))
# Rows of the method after those of the differences.
PSI_ROW, D_ROW, DELTA, PIVOT, START, END, SCALE = range(8, 15)
# Numbers of the method, from S on; CHANGE and PRODUCT are matrices of 6 by 6.
ORDER_NOW, LAST_ORDER, LAST_LENGTH, SAME, RATE_NOW, HAS_RATE, CURRENT, SHORTEST_YET = range(8)
STEP_ORDER, STEP_LENGTH, INVERSE, CHANGE, PRODUCT = 8, 9, 10, 11, 47


@inner
def row(j):
    """Index of a row of the method; rows 1 to 7 are the differences."""
    return K1 + NSTATES * j


# -- linear algebra --------------------------------------------------------------------------------
@kernel
def new_jacobian(t, work):
    """J at NODE."""
    c, h = part(work, C, NCONST), part(work, H, HELD * NCLOCKS)
    drive_at(t, Q, work)
    y, q = part(work, NODE, NSTATES), part(work, Q, NDRIVE)
    jacobian(t, y, c, q, h, part(work, M, NSTATES * NSTATES))
    work[S + CURRENT] = 1.0


@kernel
def factorise(length, k, work):
    """I - length/(G_k (1 - kappa_k)) J as a product of triangles, with pivots."""
    scale, lu = length * INVERSES[k], M + NSTATES * NSTATES
    work[S + INVERSE], work[S + HAS_RATE] = scale, 0.0
    for i in range(NSTATES):
        for j in range(NSTATES):
            one = 1.0 if i == j else 0.0
            work[lu + NSTATES * i + j] = one - scale * work[M + NSTATES * i + j]
    for p in range(NSTATES):
        best = p
        for i in range(p + 1, NSTATES):
            if abs(work[lu + NSTATES * i + p]) > abs(work[lu + NSTATES * best + p]):
                best = i
        work[row(PIVOT) + p] = float(best)
        for j in range(NSTATES):
            a, b = work[lu + NSTATES * p + j], work[lu + NSTATES * best + j]
            work[lu + NSTATES * p + j], work[lu + NSTATES * best + j] = b, a
        for i in range(p + 1, NSTATES):
            factor = work[lu + NSTATES * i + p] / work[lu + NSTATES * p + p]
            work[lu + NSTATES * i + p] = factor
            for j in range(p + 1, NSTATES):
                work[lu + NSTATES * i + j] -= factor * work[lu + NSTATES * p + j]


@kernel
def solve(work):
    """Solve the system with DELTA as its right-hand side, into DELTA."""
    lu, x = M + NSTATES * NSTATES, row(DELTA)
    for p in range(NSTATES):
        best = int(work[row(PIVOT) + p])
        work[x + p], work[x + best] = work[x + best], work[x + p]
    for i in range(NSTATES):
        for j in range(i):
            work[x + i] -= work[lu + NSTATES * i + j] * work[x + j]
    for i in range(NSTATES - 1, -1, -1):
        for j in range(i + 1, NSTATES):
            work[x + i] -= work[lu + NSTATES * i + j] * work[x + j]
        work[x + i] /= work[lu + NSTATES * i + i]


@inner
def norm_of(at, other, sign_of_other, work):
    """Max norm of a row on the scale of the step, with another row added or not; NaN if any entry
    is NaN.
    """
    norm = 0.0
    for j in range(NSTATES):
        ratio = abs((work[at + j] + sign_of_other * work[other + j]) / work[row(SCALE) + j])
        if ratio > norm or ratio != ratio:
            norm = ratio
    return norm


# -- length and order ------------------------------------------------------------------------------
@kernel
def begin_leg(i, t, t_end, batch, work):
    """Begin a leg: order 1, and a first length from the second derivative, from NODE and K1."""
    rtol, theta = batch.options[i, RTOL], batch.options[i, ATOL] / batch.options[i, RTOL]
    for j in range(NUMBERS_OF_METHOD):
        work[S + j] = 0.0
    shortest, norm = 16.0 * ulp(t), 0.0
    for j in range(NSTATES):
        norm = max(norm, abs(work[K1 + j] / max(abs(work[NODE + j]), theta)))
    longest = longest_step(t, t_end)
    rate = 1.25 * norm / math.sqrt(rtol)
    length = max(1.0 / rate if longest * rate > 1.0 else longest, shortest)
    new_jacobian(t, work)
    ahead = t + min(math.sqrt(EPSILON) * max(abs(t), abs(t + length)), length)
    drive_at(ahead, Q_STAGE, work)
    rate_at(ahead, NODE, Q_STAGE, FROM_STATE, K_END, work)
    norm = 0.0
    for j in range(NSTATES):
        second = (work[K_END + j] - work[K1 + j]) / (ahead - t)
        for n in range(NSTATES):
            second += work[M + NSTATES * j + n] * work[K1 + n]
        norm = max(norm, abs(second / max(abs(work[NODE + j]), theta)))
    rate = 1.25 * math.sqrt(0.5 * norm / rtol)
    length = max(1.0 / rate if longest * rate > 1.0 else longest, shortest)
    for j in range(NSTATES):
        work[row(1) + j] = length * work[K1 + j]
        for n in range(2, MOST_ORDER + 3):
            work[row(n) + j] = 0.0
    work[S + ORDER_NOW] = work[S + LAST_ORDER] = 1.0
    work[S + LAST_LENGTH] = batch.carry[i, LENGTH] = length
    factorise(length, 1, work)


@kernel
def change_length(share, k, work):
    """Rescale the differences to a length `share` times the one before."""
    for j in range(1, k + 1):
        total = 1.0
        for i in range(1, k + 1):
            total *= (i - 1 - j * share) / i
            work[S + CHANGE + 6 * i + j] = total
    for i in range(1, k + 1):
        for j in range(1, k + 1):
            total, binomial = 0.0, 1.0
            for n in range(1, j + 1):  # the matrix (-1)^n (j over n)
                binomial *= -(j - n + 1) / n
                total += work[S + CHANGE + 6 * i + n] * binomial
            work[S + PRODUCT + 6 * i + j] = total
    for s in range(NSTATES):
        for j in range(1, k + 1):
            total = 0.0
            for i in range(1, k + 1):
                total += work[row(i) + s] * work[S + PRODUCT + 6 * i + j]
            work[S + CHANGE + j] = total
        for j in range(1, k + 1):
            work[row(j) + s] = work[S + CHANGE + j]
    work[S + SAME] = 0.0


@inner
def stretched(length, ratio, safety, power):
    """Length of a step whose error was `ratio` times RelTol."""
    shrink = safety * ratio**power
    return length / shrink if shrink > 0.1 else 10.0 * length


@kernel
def choose(i, length, k, err, rtol, batch, work):
    """Order and length of the step after an accepted one."""
    same = min(work[S + SAME] + 1.0, MOST_ORDER + 2.0)
    work[S + SAME], best, order = same, length, k
    if same >= k + 2.0:
        best = stretched(length, err / rtol, 1.2, 1.0 / (k + 1))
        if k > 1:
            lower = norm_of(row(k), REST, 0.0, work) * CONSTANTS[k - 1]
            new = stretched(length, lower / rtol, 1.3, 1.0 / k)
            if new > best:
                best, order = new, k - 1
        if k < MOST_ORDER:
            higher = norm_of(row(k + 2), REST, 0.0, work) * CONSTANTS[k + 1]
            new = stretched(length, higher / rtol, 1.4, 1.0 / (k + 2))
            if new > best:
                best, order = new, k + 1
    if best <= length:
        best, order = length, k
    work[S + ORDER_NOW], batch.carry[i, LENGTH] = float(order), best


# -- one step --------------------------------------------------------------------------------------
@kernel
def predict(k, theta, work):
    """Extrapolate the differences to START and NEXT, with scale and psi; d = 0."""
    for j in range(NSTATES):
        total, known = 0.0, 0.0
        for n in range(1, k + 1):
            total += work[row(n) + j]
            known += work[row(n) + j] * (GAMMAS[n] * INVERSES[k])
        work[row(START) + j] = work[NEXT + j] = work[NODE + j] + total
        work[row(PSI_ROW) + j], work[row(D_ROW) + j] = known, 0.0
        size = max(abs(work[NODE + j]), abs(work[NEXT + j]))
        work[row(SCALE) + j] = max(size, theta)


@kernel
def converges(t_new, rtol, work):
    """Simplified Newton iterations for d, and the state with it in NEXT; True if they converge
    soon.
    """
    least = 100.0 * EPSILON * norm_of(NEXT, REST, 0.0, work)
    before = 0.0
    for iteration in range(1, MOST_ITERATIONS + 1):
        rate_at(t_new, NEXT, Q_STAGE, FROM_STATE, row(DELTA), work)
        for j in range(NSTATES):
            known = work[row(PSI_ROW) + j] + work[row(D_ROW) + j]
            work[row(DELTA) + j] = work[S + INVERSE] * work[row(DELTA) + j] - known
        solve(work)
        change = norm_of(row(DELTA), REST, 0.0, work)
        for j in range(NSTATES):
            work[row(D_ROW) + j] += work[row(DELTA) + j]
            work[NEXT + j] = work[row(START) + j] + work[row(D_ROW) + j]
        if change <= least:
            return True
        rate = work[S + RATE_NOW]
        if iteration == 1:
            if work[S + HAS_RATE] == 0.0:
                work[S + RATE_NOW] = 0.0
            elif change * rate / (1.0 - rate) <= 0.05 * rtol:
                return True
        elif not change <= 0.9 * before:
            return False
        else:
            rate = max(0.9 * rate, change / before)
            work[S + RATE_NOW], work[S + HAS_RATE] = rate, 1.0
            left = change * rate / (1.0 - rate)
            if left <= 0.5 * rtol:
                return True
            if iteration == MOST_ITERATIONS:
                return False
            if 0.5 * rtol < left * rate ** (MOST_ITERATIONS - iteration):
                return False
        before = change
    return False


@inner
def shorter(length, err, k, first, rtol, work):
    """Length and order after an error that was too large."""
    if not first:
        return 0.5 * length, k
    best, order = length * max(0.1, 0.833 * (rtol / err) ** (1.0 / (k + 1))), k
    if k > 1:
        lower = norm_of(row(k), row(D_ROW), 1.0, work) * CONSTANTS[k - 1]
        new = length * max(0.1, 0.769 * (rtol / lower) ** (1.0 / k))
        if new > best:
            best, order = min(length, new), k - 1
    return best, order


@kernel
def step(i, t, t_stop, t_leg, t_end, batch, work):
    """One accepted step: (t_new, h, True if it succeeded, rejections). It fails if no step is short
    enough, for the iteration or for the error.
    """
    rtol, theta = batch.options[i, RTOL], batch.options[i, ATOL] / batch.options[i, RTOL]
    shortest = 16.0 * ulp(t)
    length = max(shortest, min(longest_step(t_leg, t_end), batch.carry[i, LENGTH]))
    if length == shortest and work[S + SHORTEST_YET] != 0.0:
        length = work[S + LAST_LENGTH]
    work[S + SHORTEST_YET] = 1.0 if length == shortest else 0.0
    last = 1.1 * length >= t_stop - t
    if last:
        length = t_stop - t
    k, first, rejections = int(work[S + ORDER_NOW]), True, 0
    if length != work[S + LAST_LENGTH] or k != int(work[S + LAST_ORDER]):
        change_length(length / work[S + LAST_LENGTH], k, work)
        factorise(length, k, work)
    while True:
        t_new = t_stop if last else t + length
        drive_at(t_new, Q_STAGE, work)
        predict(k, theta, work)
        slow = not converges(t_new, rtol, work)
        err = norm_of(row(D_ROW), REST, 0.0, work) * CONSTANTS[k]
        if not slow and not err > rtol:
            break
        rejections += 1
        if slow and work[S + CURRENT] == 0.0:
            new_jacobian(t, work)
        elif length <= shortest:
            return t_new, t_new - t, False, rejections
        else:
            before, order = length, k
            if slow:
                length = 0.3 * length
            else:
                length, order = shorter(length, err, k, first, rtol, work)
                first = False
            length = max(length, shortest)
            last = last and length == before
            k = order
            change_length(length / before, k, work)
        factorise(length, k, work)
    accept(t_new, length, k, work)
    choose(i, length, k, err, rtol, batch, work)
    return t_new, t_new - t, err <= rtol, rejections


@kernel
def accept(t_new, length, k, work):
    """The differences at the end of the step, and its rate to K_END."""
    for j in range(NSTATES):
        d = work[row(D_ROW) + j]
        work[ERROR + j] = CONSTANTS[k] * d / length
        work[row(k + 2) + j] = d - work[row(k + 1) + j]
        work[row(k + 1) + j] = d
        for n in range(k, 0, -1):
            work[row(n) + j] += work[row(n + 1) + j]
        work[row(END) + j] = work[NEXT + j]
    rate_at(t_new, NEXT, Q_STAGE, FROM_STATE, K_END, work)
    work[S + STEP_ORDER] = work[S + LAST_ORDER] = float(k)
    work[S + STEP_LENGTH] = work[S + LAST_LENGTH] = length
    work[S + CURRENT] = 0.0


@kernel
def dense(time, t, h, work):
    """The state at a time inside the step, to POINT: the polynomial of the formula."""
    s, factor = ((time - t) - h) / work[S + STEP_LENGTH], 1.0
    for j in range(NSTATES):
        work[POINT + j] = work[row(END) + j]
    for n in range(1, int(work[S + STEP_ORDER]) + 1):
        factor *= (s + n - 1.0) / n
        for j in range(NSTATES):
            work[POINT + j] += work[row(n) + j] * factor
