"""Template: ode113, Adams-Bashforth-Moulton formulas of orders 1 to 13 in PECE mode, with variable
step length and order.

The step is that of Shampine & Gordon, Computer Solution of Ordinary Differential Equations (1975),
with the error control of Shampine & Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18 (1997).
A step predicts with order k, evaluates, corrects with order k + 1, and evaluates again.

Symbols
-------
k order of the predictor; ns steps taken with the present length; phi_i modified divided differences
of the rate, in the rows after K1; psi_i sums of the last lengths; g_i coefficients of the formulas
of the step; sigma_i, GAMMA_i those of the error estimates; p the prediction, theta = AbsTol/RelTol.
Arrays count from 1, as in the book.
"""

MOST_ORDER = 12
#: Room of an array of numbers.
ARRAY = 14
# Numbers of the method, from S on.
PSI, ALPHA, BETA, SIGMA, W, V, G = (ARRAY * row for row in range(7))
ORDER_NOW, LAST_ORDER, LAST_H, SAME, STARTING = range(7 * ARRAY, 7 * ARRAY + 5)
#: |gamma*_i| of the Adams-Moulton formulas, from i = 1 on.
GAMMA = (0.0, 0.5, 0.0833, 0.0417, 0.0264, 0.0188, 0.0143, 0.0114, 0.00936, 0.00789, 0.00679,
    0.00592, 0.00524, 0.00468)  # fmt: skip


@inner
def phi(i):
    """Index of difference i; after the last one, that of the state at the end of the step."""
    return K1 + NSTATES * i


@kernel
def begin_leg(i, t, t_end, batch, work):
    """Order 1, and the default length of the first step, from NODE and K1."""
    rtol, theta = batch.options[i, RTOL], batch.options[i, ATOL] / batch.options[i, RTOL]
    for j in range(NUMBERS_OF_METHOD):
        work[S + j] = 0.0
    norm = 0.0
    for j in range(NSTATES):
        norm = max(norm, abs(work[K1 + j] / max(abs(work[NODE + j]), theta)))
        for row in range(1, ARRAY + 1):
            work[phi(row) + j] = 0.0
        work[phi(1) + j] = work[K1 + j]
    rate = norm / (0.25 * math.sqrt(rtol))
    length = longest_step(t, t_end)
    if length * rate > 1.0:
        length = 1.0 / rate
    batch.carry[i, LENGTH] = max(length, 16.0 * ulp(t))
    work[S + SIGMA + 1] = work[S + G + 1] = 1.0
    work[S + G + 2] = 0.5
    work[S + ORDER_NOW] = work[S + STARTING] = 1.0


@kernel
def coefficients(k, h, ns, work):
    """The entries of alpha, beta, sigma, psi and g that the step length has changed."""
    last = int(work[S + LAST_ORDER])
    work[S + BETA + ns], work[S + ALPHA + ns], work[S + SIGMA + ns + 1] = 1.0, 1.0 / ns, 1.0
    sum_now = h * ns
    for i in range(ns + 1, k + 1):
        sum_before = work[S + PSI + i - 1]
        work[S + PSI + i - 1] = sum_now
        sum_now = sum_before + h
        work[S + BETA + i] = work[S + BETA + i - 1] * work[S + PSI + i - 1] / sum_before
        work[S + ALPHA + i] = h / sum_now
        work[S + SIGMA + i + 1] = i * work[S + ALPHA + i] * work[S + SIGMA + i]
    work[S + PSI + k] = sum_now
    if ns == 1:
        for i in range(1, k + 1):
            work[S + V + i] = work[S + W + i] = 1.0 / (i * (i + 1))
    else:
        if k > last:
            work[S + V + k] = 1.0 / (k * (k + 1))
            for j in range(1, ns - 1):
                work[S + V + k - j] -= work[S + ALPHA + j + 1] * work[S + V + k - j + 1]
        for i in range(1, k + 2 - ns):
            work[S + V + i] -= work[S + ALPHA + ns] * work[S + V + i + 1]
            work[S + W + i] = work[S + V + i]
        work[S + G + ns + 1] = work[S + W + 1]
    for i in range(ns + 2, k + 2):
        for j in range(1, k + 3 - i):
            work[S + W + j] -= work[S + ALPHA + i - 1] * work[S + W + j + 1]
        work[S + G + i] = work[S + W + 1]


@kernel
def predict(t_new, h, k, ns, work):
    """Predict p to POINT and its rate to K_END; the differences become those of p at t_new."""
    for j in range(NSTATES):
        for i in range(ns + 1, k + 1):
            work[phi(i) + j] *= work[S + BETA + i]
        work[phi(k + 2) + j], work[phi(k + 1) + j] = work[phi(k + 1) + j], 0.0
        total = 0.0
        for i in range(k, 0, -1):
            total += work[S + G + i] * work[phi(i) + j]
            work[phi(i) + j] += work[phi(i + 1) + j]
        work[POINT + j] = work[NODE + j] + h * total
    drive_at(t_new, Q_STAGE, work)
    rate_at(t_new, POINT, Q_STAGE, FROM_STATE, K_END, work)


@kernel
def take_back(k, h, work):
    """Undo predict and the sums of coefficients."""
    for j in range(NSTATES):
        for i in range(1, k + 1):
            work[phi(i) + j] = (work[phi(i) + j] - work[phi(i + 1) + j]) / work[S + BETA + i]
    for i in range(2, k + 1):
        work[S + PSI + i - 1] = work[S + PSI + i] - h


@inner
def size_of(row, change, theta, work):
    """Max norm of a difference, and of the change of the rate if asked for, on the scale of the
    states at NODE; NaN if any of it is NaN.
    """
    norm = 0.0
    for j in range(NSTATES):
        value = work[row + j]
        if change:
            value += work[K_END + j] - work[phi(1) + j]
        ratio = abs(value / max(abs(work[NODE + j]), theta))
        if ratio > norm or ratio != ratio:
            norm = ratio
    return norm


@kernel
def correct(t_new, h, k, work):
    """Correct: the end of the step to NEXT, its rate to K_END, and the differences there."""
    for j in range(NSTATES):
        change = work[K_END + j] - work[phi(1) + j]
        work[ERROR + j] = (work[S + G + k] - work[S + G + k + 1]) * change
        work[NEXT + j] = work[POINT + j] + h * work[S + G + k + 1] * change
        work[phi(ARRAY + 1) + j] = work[NEXT + j]
    rate_at(t_new, NEXT, Q_STAGE, FROM_STATE, K_END, work)
    for j in range(NSTATES):
        work[phi(k + 1) + j] = work[K_END + j] - work[phi(1) + j]
        work[phi(k + 2) + j] = work[phi(k + 1) + j] - work[phi(k + 2) + j]
        for i in range(1, k + 1):
            work[phi(i) + j] += work[phi(k + 1) + j]


@kernel
def step(i, t, t_stop, t_leg, t_end, batch, work):
    """One accepted step: (t_new, h, True if it succeeded, rejections). It fails unless err <= rtol:
    for NaN, or if no step is short enough.
    """
    rtol, theta = batch.options[i, RTOL], batch.options[i, ATOL] / batch.options[i, RTOL]
    h, shortest, last = length_asked(i, t, t_stop, t_leg, t_end, batch)
    k, ns, rejections = int(work[S + ORDER_NOW]), int(work[S + SAME]), 0
    while True:
        if h != work[S + LAST_H] or rejections > 0:
            ns = 0
        if ns <= work[S + LAST_ORDER]:
            ns += 1
        if k >= ns:
            coefficients(k, h, ns, work)
        t_new = t_stop if last else t + h
        predict(t_new, h, k, ns, work)
        change = size_of(REST, True, theta, work)
        err = h * (work[S + G + k] - work[S + G + k + 1]) * change
        err_k = h * work[S + SIGMA + k + 1] * GAMMA[k] * change
        err_1, err_2 = 0.0, 0.0
        if k >= 2:
            err_1 = h * work[S + SIGMA + k] * GAMMA[k - 1] * size_of(phi(k), True, theta, work)
        if k >= 3:
            scale = h * work[S + SIGMA + k - 1] * GAMMA[k - 2]
            err_2 = scale * size_of(phi(k - 1), True, theta, work)
        lower = (k == 2 and err_1 <= 0.5 * err_k) or (k > 2 and max(err_1, err_2) <= err_k)
        if not err > rtol or h <= shortest:
            break
        work[S + STARTING] = 0.0
        take_back(k, h, work)
        rejections += 1
        reduce = 0.5
        if rejections > 3:
            reduce = min(0.5, math.sqrt(0.5 * rtol / err_k))
        k = 1 if rejections == 3 else k - 1 if lower else k
        h, last = max(reduce * h, shortest), False
    work[S + LAST_ORDER], work[S + LAST_H], work[S + SAME] = float(k), h, float(ns)
    correct(t_new, h, k, work)
    choose(i, h, k, ns, lower, err_k, err_1, rtol, theta, batch, work)
    return t_new, t_new - t, err <= rtol, rejections


@kernel
def choose(i, h, k, ns, lower, err_k, err_1, rtol, theta, batch, work):
    """Order and length of the step after an accepted one."""
    if lower or k == MOST_ORDER:
        work[S + STARTING] = 0.0
    starting, new, err = work[S + STARTING] != 0.0, k, err_k
    if starting:
        new = k + 1
    elif lower:
        new, err = k - 1, err_1
    elif k + 1 <= ns:
        higher = h * GAMMA[k + 1] * size_of(phi(k + 2), False, theta, work)
        if k == 1:
            if higher < 0.5 * err_k:
                new, err = k + 1, higher
        elif err_1 <= min(err_k, higher):
            new, err = k - 1, err_1
        elif k < MOST_ORDER and higher < err_k:
            new, err = k + 1, higher
    work[S + ORDER_NOW] = float(new)
    length = h
    if starting or 0.5 * rtol >= err * 2.0 ** (new + 1):
        length = 2.0 * h
    elif 0.5 * rtol < err:
        length = h * max(0.5, min(0.9, (0.5 * rtol / err) ** (1.0 / (new + 1))))
    batch.carry[i, LENGTH] = length


@kernel
def dense(time, t, h, work):
    """The state at a time inside the step, to POINT: the polynomial of the corrector."""
    back, order = (time - t) - h, int(work[S + LAST_ORDER]) + 1
    for j in range(1, order + 1):
        work[S + W + j] = 1.0 / j
    for j in range(NSTATES):
        work[POINT + j] = work[phi(1) + j]
    before = 0.0
    for row in range(2, order + 1):
        psi = work[S + PSI + row - 1]
        gamma, eta = (back + before) / psi, back / psi
        for j in range(1, order + 2 - row):
            work[S + W + j] = gamma * work[S + W + j] - eta * work[S + W + j + 1]
        for j in range(NSTATES):
            work[POINT + j] += work[S + W + 1] * work[phi(row) + j]
        before = psi
    for j in range(NSTATES):
        work[POINT + j] = work[phi(ARRAY + 1) + j] + back * work[POINT + j]
