"""What Python adds: a fit and a step, two threads, and the memory of large arrays.

``python overhead.py [PART]`` makes one PART-th of all runs.

Compare the first lines with those of ``cargo run --release -p hoid-evidence --example overhead``, on a
machine at rest, with a release build of the module (``pip install ./python``).
"""

from __future__ import annotations

import resource
import statistics
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import pyhoid


PART = int(sys.argv[1]) if len(sys.argv) > 1 else 1


def times(runs: int, work: Callable[[], object]) -> list[float]:
    found = []
    for _ in range(max(runs // PART, 1)):
        begun = time.perf_counter()
        work()
        found.append(time.perf_counter() - begun)
    return found


def median(runs: int, work: Callable[[], object]) -> float:
    return statistics.median(times(runs, work))


def best(runs: int, work: Callable[[], object]) -> float:
    return min(times(runs, work))


def main() -> None:
    record = pyhoid.simulate("C1", seed=1)
    for structure, runs, orders in (("arx", 400, {}), ("bj", 200, {"nd": 1})):
        seconds = median(runs, lambda: pyhoid.identify(record, structure, nk=29, **orders))
        print(f"identify {structure:4}  {seconds * 1e6:9.1f} us")
    start = pyhoid.identify(record, nk=29, nd=1).parameters
    e, u = record.e.tolist(), record.u.tolist()
    for method in ("rpem", "physical"):
        tracker = pyhoid.Tracker(method, nk=29, start=start)
        step = tracker.step

        def steps() -> None:
            for x, y in zip(e, u):
                step(x, y)

        each = median(20, steps) / len(e)
        many = median(20, lambda: tracker.update(record.e, record.u)) / len(e)
        print(f"step {method:8}  {each * 1e6:9.3f} us; by update {many * 1e6:.3f} us")

    def fits(_: int) -> None:
        for _ in range(200 // PART):
            pyhoid.identify(record, nk=29, nd=1)

    # The best of some: what else runs on the machine takes from two threads more than from one.
    one = best(7, lambda: fits(0))
    with ThreadPoolExecutor(2) as pool:
        two = best(7, lambda: list(pool.map(fits, range(2))))
    print(
        f"{200 // PART} fits in one thread {one:.3f} s, as many in each of two {two:.3f} s: {two / one:.2f} times"
    )

    n = 10_000_000 // PART
    e, u = (np.random.default_rng(k).normal(size=n) for k in (0, 1))
    tracker = pyhoid.Tracker("rls", structure="arx", na=1, nb=1, nk=1, start="nothing")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    pyhoid.Record(e=e, u=u, sample_time=0.01)
    made = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    tracker.update(e[: n // 2], u[: n // 2])
    print(
        f"arrays of {2 * e.nbytes / 1e6:.0f} MB: resident memory grows by"
        f" {(made - before) / 1e3:.0f} MB while a record is made (its check)"
    )


if __name__ == "__main__":
    main()
