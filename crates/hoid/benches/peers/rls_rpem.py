"""The recursions and the closed loop as a Python user with Numba would write them: plain loops, one triangle of a plain covariance, the
estimate kept after every sample. No error bars, no guard against windup, no limit on outliers.

`python rls_rpem.py RECORD.csv [REPETITIONS]` prints one line of JSON for each task: {"task", "peer", "seconds", "answer"}, with the shortest
time of the repetitions and what the task ends with. RECORD.csv has the columns e, u without their names.

| task | what |
|---|---|
| rls | ARX, na = 2, nb = 2, nk = 29, lambda = 1 - 1/256, from zero with P = 0.1 |
| rpem | Box-Jenkins, nb = 2, nd = 1, nf = 2, nk = 29, the same memory, from (.04, -.04, -.8, -1.9, .92) with P = 0.1; C is none, F is kept stable |
| loop | one run of condition C1 (9192 samples with the run-in) without remnant: e, u, x, n; answer: last e and u |
| loop with noise | the same with remnant, the normal deviates drawn |

`python rls_rpem.py` without a record does the loop alone. Needs numpy, numba and scipy.
"""

import json
import sys
import time

import numba
import numpy as np
from scipy.linalg import expm

NK = 29
LAMBDA = 1.0 - 1.0 / 256.0


@numba.njit
def rls(e, u, history):
    n = 4
    theta = np.zeros(n)
    psi = np.zeros(n)
    g = np.zeros(n)
    p = np.zeros((n, n))
    for i in range(n):
        p[i, i] = 0.1
    inverse = 1.0 / LAMBDA
    for t in range(len(u)):
        psi[3] = psi[2]
        psi[2] = e[t - NK] if t >= NK else 0.0
        eps = u[t]
        power = 0.0
        for i in range(n):
            eps -= psi[i] * theta[i]
            s = 0.0
            for j in range(n):
                s += (p[i, j] if j <= i else p[j, i]) * psi[j]
            g[i] = s
            power += s * psi[i]
        scale = 1.0 / (LAMBDA + power)
        step = scale * eps
        for i in range(n):
            theta[i] += g[i] * step
            along = g[i] * scale
            for j in range(i + 1):
                p[i, j] = (p[i, j] - along * g[j]) * inverse
        psi[1] = psi[0]
        psi[0] = -u[t]
        history[t, :] = theta


@numba.njit
def rpem(e, u, history):
    n = 5
    b0, b1, d1, f1, f2 = 0.04, -0.04, -0.8, -1.9, 0.92
    psi = np.zeros(n)
    g = np.zeros(n)
    p = np.zeros((n, n))
    for i in range(n):
        p[i, i] = 0.1
    inverse = 1.0 / LAMBDA
    # Past input, response, noise; input and response through D/F, in direct form.
    x1 = w1 = w2 = v1 = 0.0
    xd1 = xd2 = wd1 = wd2 = 0.0
    for t in range(len(u)):
        x = e[t - NK] if t >= NK else 0.0
        xd = x + d1 * x1 - f1 * xd1 - f2 * xd2
        psi[0] = xd
        psi[1] = xd1
        psi[2] = -v1
        psi[3] = -wd1
        psi[4] = -wd2
        w = b0 * x + b1 * x1 - f1 * w1 - f2 * w2
        eps = u[t] - w + d1 * v1
        power = LAMBDA
        for i in range(n):
            s = 0.0
            for j in range(n):
                s += (p[i, j] if j <= i else p[j, i]) * psi[j]
            g[i] = s
            power += s * psi[i]
        scale = 1.0 / power
        step = scale * eps
        share = 1.0
        for _ in range(13):
            a1 = f1 + share * g[3] * step
            a2 = f2 + share * g[4] * step
            if abs(a2) < 1.0 and abs(a1) < 1.0 + a2:
                break
            share *= 0.5
        else:
            share = 0.0
        step *= share
        b0 += g[0] * step
        b1 += g[1] * step
        d1 += g[2] * step
        f1 += g[3] * step
        f2 += g[4] * step
        for i in range(n):
            along = g[i] * scale
            for j in range(i + 1):
                p[i, j] = (p[i, j] - along * g[j]) * inverse
        w = b0 * x + b1 * x1 - f1 * w1 - f2 * w2
        wd = w + d1 * w1 - f1 * wd1 - f2 * wd2
        x1 = x
        w2 = w1
        w1 = w
        v1 = u[t] - w
        xd2 = xd1
        xd1 = xd
        wd2 = wd1
        wd1 = wd
        history[t, 0] = b0
        history[t, 1] = b1
        history[t, 2] = d1
        history[t, 3] = f1
        history[t, 4] = f2


# Condition C1.
TS, RUN_IN, SAMPLES = 0.01, 1000, 9192
K_E, K_E_DOT, OMEGA, ZETA, DELAY = 0.09, 0.036, 11.25, 0.35, 28
T_N, K_N, K_C, OMEGA_B = 0.06, 0.1, 90.0, 6.0
TABLE_1 = np.array(
    [
        [3, 1.186, -0.753],
        [5, 1.121, 1.564],
        [8, 0.991, 0.588],
        [13, 0.756, -0.546],
        [22, 0.447, 0.674],
        [34, 0.245, -1.724],
        [53, 0.123, -1.963],
        [86, 0.061, -2.189],
        [139, 0.036, 0.875],
        [229, 0.025, 0.604],
    ]
)


def held(a1, a2):
    """Transition and input of 1/(s^2 + a1 s + a2), output and rate, over one sample."""
    m = expm(np.array([[0.0, 1.0, 0.0], [-a2, -a1, 1.0], [0.0, 0.0, 0.0]]) * TS)
    return np.ascontiguousarray(m[:2, :2]), np.ascontiguousarray(m[:2, 2])


@numba.njit
def loop(f, noise, draw, po, go, pe, ge, decay, memory, e, u, x, n):
    o0 = o1 = c0 = c1 = z = 0.0
    memory[:] = 0.0
    at = 0
    for k in range(len(f)):
        x[k] = c0
        e[k] = f[k] - c0
        response = memory[at]
        memory[at] = OMEGA * OMEGA * (K_E * o0 + K_E_DOT * o1)
        at = at + 1 if at + 1 < len(memory) else 0
        n[k] = K_N * z if draw else 0.0
        u[k] = response + n[k]
        o0, o1 = po[0, 0] * o0 + po[0, 1] * o1 + go[0] * e[k], po[1, 0] * o0 + po[1, 1] * o1 + go[1] * e[k]
        v = K_C * u[k]
        c0, c1 = pe[0, 0] * c0 + pe[0, 1] * c1 + ge[0] * v, pe[1, 0] * c0 + pe[1, 1] * c1 + ge[1] * v
        z = decay * z + (1.0 - decay) * (np.random.standard_normal() if draw else noise[k])


def loops(repetitions):
    t = (np.arange(SAMPLES) - RUN_IN) * TS
    f = sum(a * np.sin(k * 2 * np.pi / 81.92 * t + phase) for k, a, phase in TABLE_1)
    po, go = held(2 * ZETA * OMEGA, OMEGA * OMEGA)
    pe, ge = held(OMEGA_B, 0.0)
    e, u, x, n, noise = np.zeros((5, SAMPLES))
    memory, decay = np.zeros(DELAY), np.exp(-TS / T_N)
    for name, draw in [("loop", False), ("loop with noise", True)]:
        seconds = fastest(lambda: loop(f, noise, draw, po, go, pe, ge, decay, memory, e, u, x, n), repetitions)
        tell(name, seconds, [] if draw else [e[-1], u[-1]])


def fastest(task, repetitions):
    task()
    best = np.inf
    for _ in range(repetitions):
        begin = time.perf_counter()
        task()
        best = min(best, time.perf_counter() - begin)
    return best


def tell(task, seconds, answer):
    line = {"task": task, "peer": f"numba {numba.__version__}", "seconds": seconds, "answer": [float(a) for a in answer]}
    print(json.dumps(line))


def main():
    repetitions = int(sys.argv[2]) if len(sys.argv) > 2 else 200
    loops(repetitions)
    if len(sys.argv) < 2:
        return
    e, u = np.loadtxt(sys.argv[1], delimiter=",", unpack=True)
    for name, task, n in [("rls", rls, 4), ("rpem", rpem, 5)]:
        history = np.zeros((len(u), n))
        tell(name, fastest(lambda: task(e, u, history), repetitions), history[-1])


if __name__ == "__main__":
    main()
