"""The Box-Jenkins fit as a Python user would write it: scipy.optimize.least_squares with lfilter and the analytic Jacobian.

Called by `cargo run --release -p hoid-evidence --example evidence -- speed`, which gives it a record (columns e, u) and prints the ratio
of the times. Needs numpy and scipy. Orders nb = 2, nc = 0, nd = 1, nf = 2, nk = 29; zeros before the record. It is given a start
near the answer, as the ARX start misleads here; hoid gets none.
"""

import sys
import time

import numpy as np
import scipy
from scipy.optimize import least_squares
from scipy.signal import lfilter

NK = 29


def delayed(x, k):
    return np.concatenate([np.zeros(k), x[: len(x) - k]])


def main():
    e, u = np.loadtxt(sys.argv[1], delimiter=",", unpack=True)
    inputs = [delayed(e, NK), delayed(e, NK + 1)]

    def residual(theta):
        b0, b1, d1, f1, f2 = theta
        w = lfilter([1.0], [1.0, f1, f2], b0 * inputs[0] + b1 * inputs[1])
        return lfilter([1.0, d1], [1.0], u - w)

    def jacobian(theta):
        b0, b1, d1, f1, f2 = theta
        f = [1.0, f1, f2]
        w = lfilter([1.0], f, b0 * inputs[0] + b1 * inputs[1])
        x = lfilter([1.0, d1], f, inputs[0])
        y = lfilter([1.0, d1], f, w)
        v = u - w
        return np.column_stack([-x, -delayed(x, 1), delayed(v, 1), delayed(y, 1), delayed(y, 2)])

    def fit():
        best = least_squares(
            residual, [0.05, -0.05, -0.8, -1.9, 0.92], jac=jacobian, method="lm", x_scale="jac", xtol=1e-9, ftol=1e-12
        )
        covariance = np.linalg.inv(best.jac.T @ best.jac) * 2 * best.cost / (len(u) - 5)
        return best, covariance

    best, _ = fit()
    times = []
    for _ in range(int(sys.argv[2])):
        begin = time.perf_counter()
        fit()
        times.append(time.perf_counter() - begin)
    print(min(times), 2 * best.cost / len(u), scipy.__version__, np.__version__)


if __name__ == "__main__":
    main()
