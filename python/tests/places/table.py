"""The table of the book."""

from __future__ import annotations

import datetime
import platform
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from . import PLACES
from .told import Compared, Missing, Place, Run, Told, expected
from .tools import Tools, output

HEAD = """\
| interface | digits | one sample is | median | 99.9 % | size |
|---|---|---|---:|---:|---:|"""


def tables(tools: Tools) -> str:
    """One row per interface; a missing interface has a row that states it."""
    run = Run.made(tools, tools.folder)
    traces = {
        options: expected(tools, run, tools.folder, options)
        for options in {place.options for place in PLACES}
    }

    def rows() -> Iterator[str]:
        for place in PLACES:
            try:
                told = place.run(run, tools)
            except Missing as reason:
                yield f"| {place.name} | not here: {reason} | | | | |"
                continue
            yield row(place, told, told.compared(traces[place.options]))

    version = output([tools.binary, "--version"]).strip()
    day = datetime.datetime.now(datetime.timezone.utc).strftime("%-d %B %Y")
    of = tools.binary.parent.name
    profile = "release build" if of == "shipped" else "test build, with checks"
    where = f"{version}, {day}, {profile}, on {machine()}."
    return "\n".join([HEAD, *rows(), "", where])


def row(place: Place, told: Told, compared: Compared) -> str:
    times = ["", ""]
    if told.seconds is not None:
        times = [time(float(np.quantile(told.seconds, share))) for share in (0.5, 0.999)]
    size = "" if told.size is None else f"{bytes_of(told.size[0])}, {told.size[1]}"
    cells = (place.name, digits(compared), place.sample, *times, size)
    return "| " + " | ".join(cells) + " |"


def digits(compared: Compared) -> str:
    if not compared.off:
        return f"all equal, {compared.samples} rows"
    names = ", ".join(f"{name} by {by:.0e}" for name, by in compared.off.items())
    return f"equal, {compared.samples} rows, but {names}"


def time(seconds: float) -> str:
    """Three digits and a unit.

    >>> time(1.234e-6), time(0.00012345), time(0.0567)
    ('1.23 µs', '123 µs', '56.7 ms')
    """
    scale, unit = (1e6, "µs") if seconds < 1e-3 else (1e3, "ms")
    value = scale * seconds
    return f"{value:.{2 if value < 10 else 1 if value < 100 else 0}f} {unit}"


def bytes_of(size: int) -> str:
    return f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{size / 1e3:.0f} kB"


def machine() -> str:
    """The processor, as the system names it, and the system."""
    try:
        about = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        about = []
    named = [line.split(":", 1)[1].strip() for line in about if line.startswith("model name")]
    of = f"{named[0]}, {len(named)} cores" if named else platform.processor()
    return f"{of}, {platform.system()}"
