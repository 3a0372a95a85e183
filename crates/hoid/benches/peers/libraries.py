"""Libraries from PyPI that fit ARX or Box-Jenkins models or run a recursion, called as their documentation states: pysib, timeseries-toolbox,
SIPPY and padasip. Given no start where they take none.

What the answers mean: pysib starts its search at the ARX fit with zeros before the record, SIPPY gives the whole output and its optimiser the
same, timeseries-toolbox starts at random. All three therefore end with another theta than a fit that estimates the initial states.
"""

import contextlib
import io
import warnings
from importlib.metadata import version

import numpy as np

from _peer import LAMBDA, NK, delayed, measure, record, skip

ZEROS = "zeros before the record, own start"
RANDOM = "zeros before the record, random start"


def quiet(work):
    """Libraries print and warn while they fit."""

    def run():
        with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return work()

    return run


def of_pysib(e, u):
    import pysib

    peer = f"pysib {version('pysib')}"
    measure("arx", peer, quiet(lambda: pysib.arx(e, u, 2, 2, NK)[0]))
    # b, c, d, f as ours.
    measure("bj", peer, quiet(lambda: pysib.bj(e, u, 2, 0, 1, 2, NK)[0]), differs=ZEROS)


def of_sippy(e, u):
    from sippy_unipi import system_identification

    peer = f"sippy_unipi {version('sippy_unipi')}"
    arx = lambda: system_identification(u, e, "ARX", ARX_orders=[2, 2, NK - 1])
    bj = lambda: system_identification(u, e, "BJ", BJ_orders=[2, 1, 1, 2, NK - 1])

    def of_arx(model):
        den, num = np.ravel(model.DENOMINATOR), np.ravel(model.NUMERATOR)
        return [*den[1:3], *num[num != 0.0][:2]]

    def of_bj(model):
        # G = B/F and H = C/D as transfer functions with powers of z.
        f, b = model.G.den[0][0], model.G.num[0][0]
        return [*b[b != 0.0][:2], model.H.den[0][0][1], *f[1:3]]

    measure("arx", peer, quiet(arx), of_arx)
    # It fails without C.
    measure("bj", peer, quiet(bj), of_bj, differs="nc = 1, as it fails with 0")


def of_timeseries_toolbox(e, u):
    from TimeSeriesSRC.Model.estimate import estimate
    from TimeSeriesSRC.Model.model import pmodel

    def bj():
        np.random.seed(1)
        # Orders in the sense of the package: nb counts the coefficients after b0.
        model = pmodel("bjtf", nb=[1], nf=[2], nc=[0], nd=[1], delay=[NK], diff=[0], per=[])
        model, _, _ = estimate(model, u, e)
        return model

    def answer(model):
        flat = lambda part: [float(v) for v in np.ravel(np.concatenate([np.ravel(p) for p in part]))]
        b, d, f = flat(model.b), flat(model.d), flat(model.f)
        return [*[v for v in b if v != 0.0][:2], d[-1], *f[-2:]]

    measure("bj", f"timeseries-toolbox {version('timeseries-toolbox')}", quiet(bj), answer, differs=RANDOM)


def of_padasip(e, u):
    import padasip

    regressors = np.column_stack([-delayed(u, 1), -delayed(u, 2), delayed(e, NK), delayed(e, NK + 1)])

    def rls():
        recursion = padasip.filters.FilterRLS(n=4, mu=LAMBDA, eps=10.0, w="zeros")
        recursion.run(u, regressors)
        return recursion.w

    measure("rls", f"padasip {version('padasip')}", quiet(rls))


def main():
    e, u = record()
    for of, tasks, peer in [
        (of_pysib, ["arx", "bj"], "pysib"),
        (of_padasip, ["rls"], "padasip"),
        (of_sippy, ["arx", "bj"], "sippy_unipi"),
        (of_timeseries_toolbox, ["bj"], "timeseries-toolbox"),
    ]:
        try:
            of(e, u)
        except ImportError as reason:
            skip(tasks, peer, reason)


if __name__ == "__main__":
    main()
