"""Batch fits and simulation in Numba, as well as one can: each pass goes once over the data and keeps nothing, residuals, gradient and
Gauss-Newton matrix together. Compiling is not timed.

The Box-Jenkins fit is that of `batch_numpy.py`: two stages, a start near the answer. The recursions are in `rls_rpem.py`.
"""

import sys
from functools import partial

from _peer import BJ_START, CELL_RUNS, DELAYS, HIGHER_MINIMA, NK, OWN_NOISE, Loop, forcing_and_noise, measure, record, skip

TASKS = ["arx", "bj", "loop", "loop with noise", "cell", "delays"]
try:
    import numba
    import numpy as np
    from numba import njit
except ImportError as reason:
    skip(TASKS, "numba", reason)
    sys.exit()

PEER = f"numba {numba.__version__}"


@njit
def arx(e, u, nk):
    gram, moment, psi = np.zeros((4, 4)), np.zeros(4), np.empty(4)
    for t in range(nk + 1, len(u)):
        psi[0], psi[1], psi[2], psi[3] = -u[t - 1], -u[t - 2], e[t - nk], e[t - nk - 1]
        for i in range(4):
            moment[i] += psi[i] * u[t]
            for j in range(i + 1):
                gram[i, j] += psi[i] * psi[j]
    for i in range(4):
        for j in range(i):
            gram[j, i] = gram[i, j]
    return np.linalg.solve(gram, moment)


@njit
def linearise(e, u, nk, start, theta, p, gram, slope):
    """Sum of squares of eps, psi' psi and psi' eps. p = 5: b0, b1, d1, f1, f2, zeros before the record; p = 7: the two values of w before
    `start` too, residuals from the sample after it on."""
    b0, b1, d1, f1, f2 = theta[0], theta[1], theta[2], theta[3], theta[4]
    w1 = w2 = x1 = v1 = 0.0
    first = start
    if p == 7:
        w1, w2, x1, first = theta[5], theta[6], e[start - nk - 1], start + 1
    # Derivatives of w one and two samples ago: by b0, b1, f1, f2 and the two values before the start.
    r1 = r2 = s1 = s2 = g1 = g2 = h1 = h2 = m2 = n1 = 0.0
    m1 = n2 = 1.0
    gram[:] = 0.0
    slope[:] = 0.0
    psi = np.zeros(7)
    total = 0.0
    for t in range(start, len(u)):
        x = e[t - nk] if t >= nk else 0.0
        w = b0 * x + b1 * x1 - f1 * w1 - f2 * w2
        v = u[t] - w
        r = x - f1 * r1 - f2 * r2
        s = x1 - f1 * s1 - f2 * s2
        g = -w1 - f1 * g1 - f2 * g2
        h = -w2 - f1 * h1 - f2 * h2
        m = -f1 * m1 - f2 * m2
        n = -f1 * n1 - f2 * n2
        if t >= first:
            eps = v + d1 * v1
            psi[0] = -r - d1 * r1
            psi[1] = -s - d1 * s1
            psi[2] = v1
            psi[3] = -g - d1 * g1
            psi[4] = -h - d1 * h1
            psi[5] = -m - d1 * m1
            psi[6] = -n - d1 * n1
            total += eps * eps
            for i in range(p):
                slope[i] += psi[i] * eps
                for j in range(i + 1):
                    gram[i, j] += psi[i] * psi[j]
        x1, v1 = x, v
        w2, w1 = w1, w
        r2, r1 = r1, r
        s2, s1 = s1, s
        g2, g1 = g1, g
        h2, h1 = h1, h
        m2, m1 = m1, m
        n2, n1 = n1, n
    for i in range(p):
        for j in range(i):
            gram[j, i] = gram[i, j]
    return total


@njit
def loss_alone(e, u, nk, start, theta, p):
    b0, b1, d1, f1, f2 = theta[0], theta[1], theta[2], theta[3], theta[4]
    w1 = w2 = x1 = v1 = total = 0.0
    first = start
    if p == 7:
        w1, w2, x1, first = theta[5], theta[6], e[start - nk - 1], start + 1
    for t in range(start, len(u)):
        x = e[t - nk] if t >= nk else 0.0
        w = b0 * x + b1 * x1 - f1 * w1 - f2 * w2
        v = u[t] - w
        if t >= first:
            eps = v + d1 * v1
            total += eps * eps
        x1, v1, w2, w1 = x, v, w1, w
    return total


@njit
def search(e, u, nk, start, theta, p):
    gram, slope, damped = np.zeros((p, p)), np.zeros(p), np.zeros((p, p))
    loss = linearise(e, u, nk, start, theta, p, gram, slope)
    damping = 1e-4
    for _ in range(100):
        last = np.linalg.solve(gram, slope)
        if np.dot(slope, last) < 1e-12 * loss:
            theta = theta - last
            break
        found = False
        while damping < 1e8:
            damped[:] = gram
            for i in range(p):
                damped[i, i] *= 1.0 + damping
            trial = theta - np.linalg.solve(damped, slope)
            if abs(trial[4]) < 1.0 and abs(trial[3]) < 1.0 + trial[4] and loss_alone(e, u, nk, start, trial, p) < loss:
                theta, found = trial, True
                damping = max(damping / 10.0, 1e-15)
                break
            damping *= 10.0
        if not found:
            break
        loss = linearise(e, u, nk, start, theta, p, gram, slope)
    return theta, loss, gram


@njit
def bj(e, u, nk, first, guess):
    begun, _, _ = search(e, u, nk, 0, guess, 5)
    w1 = w2 = 0.0
    for t in range(nk, first - 1):
        x1 = e[t - nk - 1] if t > nk else 0.0
        w1, w2 = begun[0] * e[t - nk] + begun[1] * x1 - begun[3] * w1 - begun[4] * w2, w1
    whole = np.empty(7)
    whole[:5], whole[5], whole[6] = begun, w1, w2
    theta, loss, gram = search(e, u, nk, first - 1, whole, 7)
    rows = len(u) - first
    covariance = np.linalg.inv(gram) * (loss / (rows - 7))
    return theta[:5], loss / rows, covariance


@njit
def delays(e, u, guess, low, high):
    losses = np.empty(high - low + 1)
    start = guess
    for nk in range(low, high + 1):
        start, losses[nk - low], _ = bj(e, u, nk, high + 2, start)
    bj(e, u, NK, NK + 2, guess)
    return losses


@njit
def closed_loop(numbers, delay, forcing, noise, e, u, x, n, y):
    o11, o12, o21, o22, o1, o2, c11, c12, c21, c22, c1, c2, h0, h1, k_c, k_n, pole = numbers
    s1 = s2 = z1 = z2 = r = 0.0
    for k in range(len(forcing)):
        x[k] = z1
        e[k] = forcing[k] - z1
        y[k] = h0 * s1 + h1 * s2
        n[k] = k_n * r
        u[k] = n[k] + (y[k - delay] if k >= delay else 0.0)
        s1, s2 = o11 * s1 + o12 * s2 + o1 * e[k], o21 * s1 + o22 * s2 + o2 * e[k]
        z1, z2 = c11 * z1 + c12 * z2 + c1 * k_c * u[k], c21 * z1 + c22 * z2 + c2 * k_c * u[k]
        r = pole * r + (1.0 - pole) * noise[k]


@njit
def simulate(numbers, delay, forcing, noise):
    size = len(forcing)
    e, u, x, n, y = np.empty(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    closed_loop(numbers, delay, forcing, noise, e, u, x, n, y)
    return e, u, x, n


@njit
def simulate_with_noise(numbers, delay, forcing):
    noise = np.empty(len(forcing))
    for k in range(len(noise)):
        noise[k] = np.random.standard_normal()
    return simulate(numbers, delay, forcing, noise)


@njit
def cell(numbers, delay, run_in, forcing, guess, runs):
    total = np.zeros(9)
    for _ in range(runs):
        e, u, _, _ = simulate_with_noise(numbers, delay, forcing)
        e, u = e[run_in:], u[run_in:]
        total[:4] += arx(e, u, NK)
        total[4:] += bj(e, u, NK, NK + 2, guess)[0]
    return total / runs


def main():
    e, u = (np.ascontiguousarray(signal) for signal in record())
    forcing, noise = (np.ascontiguousarray(signal) for signal in forcing_and_noise())
    loop = Loop()
    numbers, guess = tuple(float(v) for v in loop.numbers()), np.array(BJ_START)
    timed = partial(measure, compile_first=True)
    last = lambda signals: (signals[0][-1], signals[1][-1])
    timed("arx", PEER, lambda: arx(e, u, NK))
    timed("bj", PEER, lambda: bj(e, u, NK, NK + 2, guess)[0])
    timed("loop", PEER, lambda: simulate(numbers, loop.delay, forcing, noise), last)
    timed("loop with noise", PEER, lambda: simulate_with_noise(numbers, loop.delay, forcing), lambda _: [])
    timed("cell", PEER, lambda: cell(numbers, loop.delay, loop.run_in, forcing, guess, CELL_RUNS), differs=OWN_NOISE)
    timed("delays", PEER, lambda: delays(e, u, guess, DELAYS[0], DELAYS[-1]), differs=HIGHER_MINIMA)


if __name__ == "__main__":
    main()
