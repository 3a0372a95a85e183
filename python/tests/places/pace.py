"""`python -m places.pace RATE SECONDS`: samples over LabStreamingLayer at a rate, and the times of
their answers. Prints a row of the table of `cargo xtask slow latency`, then the lost samples."""

from __future__ import annotations

import math
import sys
import threading
import time
from typing import Any

import numpy as np

from .sockets import PATIENCE, connected, liblsl


def main(rate: int, seconds: int) -> None:
    pylsl = liblsl()
    count = rate * seconds
    sent, came = np.zeros(count), np.full(count, np.nan)
    lost = [0.0]
    with connected(pylsl, rate) as (outlet, inlet):

        def receive() -> None:
            for k in range(count):
                values, _ = inlet.pull_sample(timeout=PATIENCE)
                if values is None:
                    return
                came[k] = time.perf_counter()
                lost[0] = values[-1]

        receiver = threading.Thread(target=receive)
        receiver.start()
        send(outlet, pylsl.local_clock(), rate, sent)
        receiver.join()
    trips = (came - sent)[~np.isnan(came)]
    times = [f"{1e3 * np.quantile(trips, share):.2f} ms" for share in (0.5, 0.99, 0.999, 1.0)]
    cells = ("LabStreamingLayer", f"{rate} Hz", count, len(trips), *times)
    print("| " + " | ".join(map(str, cells)) + " |")
    print(count - len(trips) + round(lost[0]))


def send(outlet: Any, start: float, rate: int, sent: Any) -> None:
    """Each sample at its time, with the time stamp of a clock without jitter."""
    begin = time.perf_counter()
    for k in range(len(sent)):
        time.sleep(max(0.0, begin + k / rate - time.perf_counter()))
        t = k / rate
        e, u = math.sin(0.9 * t) + 0.5 * math.sin(2.3 * t), 0.1 * math.sin(0.9 * t - 0.3)
        sent[k] = time.perf_counter()
        outlet.push_sample((e, u), start + t)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
