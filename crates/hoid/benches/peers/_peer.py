"""Shared parts of the peers: data, clock, and the lines of JSON that `cargo xtask bench` collects.

A peer is called as `python PEER.py RECORD.csv [RUNS [TASK,...]]`; RECORD.csv has the columns e, u without their names, and the folder holds what
the example `tasks` has written next to it. For each task it prints {"task", "peer", "seconds", "answer"} and, where its answer is another by
design, "differs" with the reason; or {"task", "peer", "skipped"} with the reason.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np

NK = 29
LAMBDA = 1.0 - 1.0 / 256.0
CELL_RUNS = 100
DELAYS = range(20, 41)
RPEM_START = [0.04, -0.04, -0.8, -1.9, 0.92]
# A given start, because the ARX start leads to another minimum here. hoid gets no start.
BJ_START = [0.05, -0.05, -0.8, -1.9, 0.92]
OWN_NOISE = "other random numbers"
# hoid finds smaller losses there.
HIGHER_MINIMA = "from its neighbour into higher minima at nk = 36, 39, 40"


def record():
    return np.loadtxt(sys.argv[1], delimiter=",", unpack=True)


def folder():
    return Path(sys.argv[1]).parent


def runs():
    return int(sys.argv[2]) if len(sys.argv) > 2 else 50


def forcing_and_noise():
    return np.loadtxt(folder() / "loop.csv", delimiter=",", unpack=True)


def truth():
    return json.loads((folder() / "truth.json").read_text())


def median(work):
    """Median time of the runs and the last answer: as many runs as requested, fewer where they would take more than 4 s, and the first
    alone where that took more than 10 s."""
    begin = time.perf_counter()
    answer = work()
    first = time.perf_counter() - begin
    if first > 10.0:
        return first, answer
    times = []
    for _ in range(max(1, min(runs(), int(4.0 / max(first, 1e-6))))):
        begin = time.perf_counter()
        answer = work()
        times.append(time.perf_counter() - begin)
    return float(np.median(times)), answer


def measure(task, peer, work, answer=lambda a: a, differs=None, compile_first=False):
    """Measures a task if it is requested, and prints its line."""
    if len(sys.argv) > 3 and sys.argv[3] and task not in sys.argv[3].split(","):
        return
    line = {"task": task, "peer": peer}
    try:
        if compile_first:
            work()
        seconds, result = median(work)
        line |= {"seconds": seconds, "answer": [float(a) for a in answer(result)]}
        if differs:
            line["differs"] = differs
    except Exception as error:  # A peer that fails is a line of the table, not the end of it.
        line["skipped"] = f"{type(error).__name__}: {error}"[:160]
    print(json.dumps(line), flush=True)


def skip(tasks, peer, reason):
    for task in tasks:
        print(json.dumps({"task": task, "peer": peer, "skipped": str(reason)[:160]}), flush=True)


def delayed(x, k):
    return np.concatenate([np.zeros(k), x[: len(x) - k]])


class Loop:
    """The closed loop of condition C1 with exact holds: the numbers for a simulation."""

    def __init__(self):
        from scipy.signal import cont2discrete

        p = truth()
        ts, w, z = p["Ts"], p["omega_nm"], p["zeta_nm"]
        hold = lambda a, b: [m.ravel() for m in cont2discrete((np.array(a), np.array(b), np.eye(2), np.zeros((2, 1))), ts)[:2]]
        self.operator, self.operator_in = hold([[0.0, 1.0], [-w * w, -2 * z * w]], [[0.0], [1.0]])
        self.element, self.element_in = hold([[0.0, 1.0], [0.0, -p["omega_b"]]], [[0.0], [1.0]])
        self.out = np.array([w * w * p["K_e"], w * w * p["K_e"] * p["T_L"]])
        self.k_c, self.k_n = p["K_c"], p["K_n"]
        self.pole = float(np.exp(-ts / p["T_n"]))
        self.delay = round(p["tau_e"] / ts)
        self.run_in = int(p["run_in"])

    def numbers(self):
        return (*self.operator, *self.operator_in, *self.element, *self.element_in, *self.out, self.k_c, self.k_n, self.pole)
