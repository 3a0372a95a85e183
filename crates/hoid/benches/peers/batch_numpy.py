"""Batch fits, simulation and recursions as a user who comes from MATLAB would write them: NumPy and SciPy, lfilter for the filters, Python for
what is recursive.

The Box-Jenkins fit goes in two stages: zeros before the record, then with the two values of w before the first one used as parameters
too, by which the answer is that of hoid. It is given a start near the answer, as the ARX start misleads here; hoid gets none.
`own LM` is a Levenberg-Marquardt method by hand, `least_squares` that of SciPy; both have the analytic Jacobian.
"""

import numpy as np
import scipy
from scipy.optimize import least_squares
from scipy.signal import lfilter

from _peer import BJ_START, CELL_RUNS, DELAYS, HIGHER_MINIMA, LAMBDA, NK, OWN_NOISE, RPEM_START, Loop, delayed, forcing_and_noise, measure, record

NUMPY = f"numpy {np.__version__}"
SCIPY = f"scipy {scipy.__version__}"


def regressors(e, u, nk=NK):
    phi = np.column_stack([-delayed(u, 1), -delayed(u, 2), delayed(e, nk), delayed(e, nk + 1)])
    return phi[nk + 1 :], u[nk + 1 :]


def arx_normal(e, u):
    phi, y = regressors(e, u)
    return np.linalg.solve(phi.T @ phi, phi.T @ y)


def arx_lstsq(e, u):
    phi, y = regressors(e, u)
    return np.linalg.lstsq(phi, y, rcond=None)[0]


class BoxJenkins:
    """Residuals and Jacobian; w starts one sample before the first residual, with two unknown values before it, or zero with the record."""

    def __init__(self, e, u, nk=NK, first=None):
        self.x0, self.x1, self.u = delayed(e, nk), delayed(e, nk + 1), u
        self.begin = (nk + 2 if first is None else first) - 1

    def zero(self, theta):
        b0, b1, d1, f1, f2 = theta
        f = [1.0, f1, f2]
        w = lfilter([1.0], f, b0 * self.x0 + b1 * self.x1)
        v = self.u - w
        x = lfilter([1.0, d1], f, self.x0)
        y = lfilter([1.0, d1], f, w)
        eps = lfilter([1.0, d1], [1.0], v)
        return eps, np.column_stack([-x, -delayed(x, 1), delayed(v, 1), delayed(y, 1), delayed(y, 2)])

    def estimated(self, theta):
        b0, b1, d1, f1, f2, w1, w2 = theta
        f, at = [1.0, f1, f2], self.begin
        x0, x1, u = self.x0[at:], self.x1[at:], self.u[at:]
        past = [-f1 * w1 - f2 * w2, -f2 * w1]
        w, _ = lfilter([1.0], f, b0 * x0 + b1 * x1, zi=past)
        v = u - w
        by = lambda signal: lfilter([1.0], f, signal)
        impulse = np.zeros(len(u))
        impulse[0] = 1.0
        h = by(impulse)
        late = delayed(h, 1)
        before1, before2 = np.concatenate([[w1], w[:-1]]), np.concatenate([[w2, w1], w[:-2]])
        by_w = [by(x0), by(x1), None, -by(before1), -by(before2), -f1 * h - f2 * late, -f2 * h]
        columns = [v[:-1] if g is None else -(g[1:] + d1 * g[:-1]) for g in by_w]
        return v[1:] + d1 * v[:-1], np.column_stack(columns)


def stable(theta):
    f1, f2 = theta[3:5]
    return abs(f2) < 1.0 and abs(f1) < 1.0 + f2


def levenberg_marquardt(model, theta, tolerance=1e-12):
    theta = np.array(theta)
    eps, jacobian = model(theta)
    loss, damping = eps @ eps, 1e-4
    for _ in range(100):
        gram, slope = jacobian.T @ jacobian, jacobian.T @ eps
        scale = np.diag(gram)
        last = np.linalg.solve(gram, slope)
        if slope @ last < tolerance * loss:
            theta = theta - last
            break
        while damping < 1e8:
            trial = theta - np.linalg.solve(gram + damping * np.diag(scale), slope)
            if stable(trial):
                new_eps, new_jacobian = model(trial)
                if new_eps @ new_eps < loss:
                    theta, eps, jacobian, loss = trial, new_eps, new_jacobian, new_eps @ new_eps
                    damping = max(damping / 10.0, 1e-15)
                    break
            damping *= 10.0
        else:
            break
    return theta, loss, eps, jacobian


def trust_region(model, theta):
    best = least_squares(lambda t: model(t)[0], theta, jac=lambda t: model(t)[1], method="lm", x_scale="jac", xtol=1e-10, ftol=1e-14, gtol=1e-14)
    return best.x, 2 * best.cost, best.fun, best.jac


def bj(e, u, search, start=BJ_START, nk=NK, first=None):
    model = BoxJenkins(e, u, nk, first)
    begun, *_ = search(model.zero, start)
    w = lfilter([1.0], [1.0, *begun[3:5]], begun[0] * model.x0 + begun[1] * model.x1)
    at = model.begin
    theta, loss, eps, jacobian = search(model.estimated, [*begun, w[at - 1], w[at - 2]])
    covariance = np.linalg.inv(jacobian.T @ jacobian) * loss / (len(eps) - 7)
    return theta[:5], loss / len(eps), covariance


def delays(e, u):
    """Losses for each delay on common samples, each from its neighbour."""
    losses, start = [], BJ_START
    for nk in DELAYS:
        start, loss, _ = bj(e, u, levenberg_marquardt, start, nk, DELAYS[-1] + 2)
        losses.append(loss)
    bj(e, u, levenberg_marquardt)
    return losses


def closed_loop(loop, forcing, noise):
    o11, o12, o21, o22, o1, o2, c11, c12, c21, c22, c1, c2, h0, h1, k_c, k_n, pole = (float(v) for v in loop.numbers())
    n = k_n * lfilter([0.0, 1.0 - pole], [1.0, -pole], noise)
    e, u, x = np.empty(len(forcing)), np.empty(len(forcing)), np.empty(len(forcing))
    y = np.zeros(len(forcing) + loop.delay)
    s1 = s2 = z1 = z2 = 0.0
    for k in range(len(forcing)):
        x[k] = z1
        e[k] = forcing[k] - z1
        y[k + loop.delay] = h0 * s1 + h1 * s2
        u[k] = y[k] + n[k]
        s1, s2 = o11 * s1 + o12 * s2 + o1 * e[k], o21 * s1 + o22 * s2 + o2 * e[k]
        z1, z2 = c11 * z1 + c12 * z2 + c1 * k_c * u[k], c21 * z1 + c22 * z2 + c2 * k_c * u[k]
    return e, u, x, n


def cell(loop, forcing):
    random = np.random.default_rng(1)
    total = np.zeros(9)
    for _ in range(CELL_RUNS):
        e, u, *_ = closed_loop(loop, forcing, random.standard_normal(len(forcing)))
        e, u = e[loop.run_in :], u[loop.run_in :]
        total += np.concatenate([arx_normal(e, u), bj(e, u, levenberg_marquardt)[0]])
    return total / CELL_RUNS


def rls(e, u):
    theta, p, psi = np.zeros(4), 0.1 * np.eye(4), np.zeros(4)
    history, x = np.empty((len(u), 4)), delayed(e, NK)
    for t in range(len(u)):
        psi = np.array([psi[0], psi[1], x[t], psi[2]])
        g = p @ psi
        scale = 1.0 / (LAMBDA + psi @ g)
        theta = theta + scale * (u[t] - psi @ theta) * g
        # Symmetric to the last bit, because an asymmetry would grow by 1/lambda per sample.
        p = (p - scale * np.outer(g, g)) / LAMBDA
        history[t] = theta
        psi = np.array([-u[t], psi[0], psi[2], psi[3]])
    return history


def rpem(e, u):
    theta, p = np.array(RPEM_START), 0.1 * np.eye(5)
    history, x = np.empty((len(u), 5)), delayed(e, NK)
    x1 = w1 = w2 = v1 = xd1 = xd2 = wd1 = wd2 = 0.0
    for t in range(len(u)):
        b0, b1, d1, f1, f2 = theta
        xd = x[t] + d1 * x1 - f1 * xd1 - f2 * xd2
        psi = np.array([xd, xd1, -v1, -wd1, -wd2])
        eps = u[t] - (b0 * x[t] + b1 * x1 - f1 * w1 - f2 * w2) + d1 * v1
        g = p @ psi
        scale = 1.0 / (LAMBDA + psi @ g)
        step = scale * eps * g
        while not stable(theta + step):
            step = step / 2
        theta = theta + step
        p = (p - scale * np.outer(g, g)) / LAMBDA
        b0, b1, d1, f1, f2 = theta
        w = b0 * x[t] + b1 * x1 - f1 * w1 - f2 * w2
        wd = w + d1 * w1 - f1 * wd1 - f2 * wd2
        x1, w2, w1, v1 = x[t], w1, w, u[t] - w
        xd2, xd1, wd2, wd1 = xd1, xd, wd1, wd
        history[t] = theta
    return history


def main():
    e, u = record()
    forcing, noise = forcing_and_noise()
    loop = Loop()
    random = np.random.default_rng(1)
    last = lambda signals: (signals[0][-1], signals[1][-1])
    measure("arx", f"{NUMPY}, normal equations", lambda: arx_normal(e, u))
    measure("arx", f"{NUMPY}, lstsq", lambda: arx_lstsq(e, u))
    measure("bj", f"{SCIPY}, own LM", lambda: bj(e, u, levenberg_marquardt)[0])
    measure("bj", f"{SCIPY}, least_squares", lambda: bj(e, u, trust_region)[0])
    measure("rls", f"{NUMPY}, loop", lambda: rls(e, u)[-1])
    measure("rpem", f"{NUMPY}, loop", lambda: rpem(e, u)[-1])
    measure("loop", f"{NUMPY}, loop", lambda: closed_loop(loop, forcing, noise), last)
    measure("loop with noise", f"{NUMPY}, loop", lambda: closed_loop(loop, forcing, random.standard_normal(len(forcing))), lambda _: [])
    measure("cell", f"{SCIPY}, own LM", lambda: cell(loop, forcing), differs=OWN_NOISE)
    measure("delays", f"{SCIPY}, own LM", lambda: delays(e, u), differs=HIGHER_MINIMA)


if __name__ == "__main__":
    main()
