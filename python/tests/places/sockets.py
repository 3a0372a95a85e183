"""UDP and LabStreamingLayer, on loopback."""

from __future__ import annotations

import json
import math
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np

from .programs import of_line
from .told import COLUMNS, ELEMENT, STEP, Missing, Place, Run, Told
from .tools import Tools

#: Timeout, far above the time of an answer, s.
PATIENCE = 30.0
SAMPLE = struct.Struct("<4sI4d")
ESTIMATE = struct.Struct("<4sI19diI")


@contextmanager
def udp_stream(tools: Tools) -> Iterator[socket.socket]:
    """`hoid stream --udp`, and a socket that is connected with it."""
    here = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    here.bind(("127.0.0.1", 0))
    here.settimeout(PATIENCE)
    # The system chooses the port, and the stream reports it.
    places = f"0:{here.getsockname()[1]}"
    command = [
        tools.binary,
        "stream",
        "--fs",
        100,
        "--udp",
        places,
        "--controlled-element",
        ELEMENT,
    ]
    with (
        here,
        subprocess.Popen(list(map(str, command)), stderr=subprocess.PIPE, text=True) as child,
    ):
        assert child.stderr is not None
        said = next(line for line in child.stderr if "listening on" in line)
        port = int(said.split("127.0.0.1:")[1].split(",")[0])
        here.connect(("127.0.0.1", port))
        try:
            yield here
        finally:
            child.send_signal(signal.SIGINT)
            said = child.stderr.read()
            child.wait(PATIENCE)
            assert " 0 skipped" in said and " 0 lines dropped" in said, said


def of_struct(answer: bytes) -> list[float]:
    return list(ESTIMATE.unpack(answer)[3 : 3 + len(COLUMNS)])


def as_struct(k: int, e: float, u: float) -> bytes:
    return SAMPLE.pack(b"hoid", k, math.nan, e, u, math.nan)


def as_json(k: int, e: float, u: float) -> bytes:
    return json.dumps({"t": k * STEP, "e": e, "u": u}).encode()


def of_json(answer: bytes) -> list[float]:
    return of_line(json.loads(answer))


def udp(
    asked: Callable[[int, float, float], bytes],
    answered: Callable[[bytes], list[float]],
    run: Run,
    tools: Tools,
) -> Told:
    if sys.platform == "win32":
        raise Missing("the stream is ended by a signal of Unix")
    rows, seconds = [], []
    with udp_stream(tools) as here:
        for k, (e, u) in enumerate(zip(run.e, run.u, strict=True)):
            sample = asked(k, e, u)
            begin = time.perf_counter()
            here.send(sample)
            answer = here.recv(1 << 16)
            seconds.append(time.perf_counter() - begin)
            rows.append(answered(answer))
    size = (tools.shipped(tools.binary), "program")
    return Told(np.array(rows), seconds=np.array(seconds), size=size)


#: The other side of LabStreamingLayer, in a separate process.
TRACKING = """
import sys
import pyhoid.lsl
tracker = pyhoid.Tracker(sample_time=1 / float(sys.argv[1]), controlled_element="90/(s(s+6))")
pyhoid.lsl.stream("hoid-place-person", "hoid-place-estimate", tracker, patience=5.0)
"""


@contextmanager
def connected(pylsl: Any, rate: float) -> Iterator[tuple[Any, Any]]:
    """An outlet of samples, and the inlet of their estimates."""
    info = pylsl.StreamInfo("hoid-place-person", "Person", 2, rate, "double64", "hoid-place")
    outlet = pylsl.StreamOutlet(info)
    with subprocess.Popen([sys.executable, "-c", TRACKING, str(rate)]) as child:
        try:
            found = pylsl.resolve_byprop("name", "hoid-place-estimate", timeout=PATIENCE)
            inlet = pylsl.StreamInlet(found[0])
            inlet.open_stream(timeout=PATIENCE)
            assert outlet.wait_for_consumers(PATIENCE)
            yield outlet, inlet
            inlet.close_stream()
        finally:
            child.terminate()


def lsl(run: Run, tools: Tools) -> Told:
    pylsl = liblsl()
    rows, seconds = [], []
    with connected(pylsl, 1 / STEP) as (outlet, inlet):
        start = pylsl.local_clock()
        for k, pair in enumerate(zip(run.e, run.u, strict=True)):
            begin = time.perf_counter()
            outlet.push_sample(pair, start + k * STEP)
            values, _ = inlet.pull_sample(timeout=PATIENCE)
            seconds.append(time.perf_counter() - begin)
            rows.append(values[: len(COLUMNS)])
    return Told(np.array(rows), seconds=np.array(seconds))


def liblsl() -> Any:
    try:
        import pylsl
    except (ImportError, RuntimeError) as error:
        raise Missing(f"there is no pylsl: {error}") from None
    return pylsl


PLACES: Iterable[Place] = (
    Place("UDP, structs", "a datagram and its answer", partial(udp, as_struct, of_struct)),
    Place("UDP, JSON", "a datagram and its answer", partial(udp, as_json, of_json)),
    Place("LabStreamingLayer, `pyhoid.lsl`", "a push and its answer", lsl),
)
