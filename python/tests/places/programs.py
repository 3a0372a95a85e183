"""Programs that read lines: `hoid` itself, Rust, C, C++, WebAssembly, a Cortex-M4 under QEMU."""

from __future__ import annotations

import json
import math
import subprocess
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from . import told
from .told import COLUMNS, ELEMENT, LOOP, OF_LOOP, OPERATOR, Missing, Place, Run, Told
from .tools import HERE, ROOT, Tools, output, program

CORTEX = "thumbv7em-none-eabihf"
WASM = "wasm32-unknown-unknown"
#: Number of samples for QEMU unless the whole run is requested.
SHORT = 400


def track(run: Run, tools: Tools) -> Told:
    """The file as a whole, not sample by sample."""
    trace = tools.folder / "place.csv"
    tools.hoid("track", run.path, "--out", trace, "--controlled-element", ELEMENT)
    found = told.table(trace)
    rows = np.array([found[name] for name in COLUMNS]).T
    return Told(rows, size=(tools.shipped(tools.binary), "program"))


def stream(run: Run, tools: Tools) -> Told:
    command = [str(tools.binary), "stream", "--fs", "100", "--controlled-element", ELEMENT]
    rows, seconds = [], []
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as child:
        assert child.stdin is not None and child.stdout is not None
        for line in run.lines():
            begin = time.perf_counter()
            child.stdin.write(line.encode())
            child.stdin.flush()
            answer = child.stdout.readline()
            seconds.append(time.perf_counter() - begin)
            rows.append(of_line(json.loads(answer)))
        child.stdin.close()
    size = (tools.shipped(tools.binary), "program")
    return Told(np.array(rows), seconds=np.array(seconds), size=size)


def of_line(line: dict[str, Any]) -> list[float]:
    """The output of a line of `hoid stream`."""
    known = {**(line["operator"] or {}), **(line["open_loop"] or {})}
    pairs = [known.get(name) or {} for name in (*OPERATOR, *LOOP)]
    numbers = [pair.get(of) for pair in pairs for of in ("value", "standard_error")]
    return [math.nan if number is None else float(number) for number in numbers]


def lines(command: list[Any], run: Run, size: tuple[int, str]) -> Told:
    """A program that answers each line with the operator and its nanoseconds."""
    text = output(command, input="".join(run.lines()))
    cells = np.array([[float(cell) for cell in line.split(",")] for line in text.splitlines()])
    return Told(cells[:, :-1], seconds=1e-9 * cells[:, -1], size=size)


def rust(run: Run, tools: Tools) -> Told:
    path = tools.example("place")
    return lines([path], run, (tools.shipped(path), "a program that includes the crate"))


def compiled(compiler: list[str], run: Run, tools: Tools) -> Told:
    library = tools.shared_library()
    path = tools.folder / "place"
    source = ["-I", ROOT / "crates/hoid-ffi/include", HERE / "place.c", "-x", "none", library]
    where = f"-Wl,-rpath,{library.parent}"
    output([*compiler, *source, "-lm", where, "-o", path])
    return lines([path], run, (tools.shipped(library), "shared library"))


def c(run: Run, tools: Tools) -> Told:
    return compiled([program("cc"), "-std=c11", "-Wall", "-Werror", "-O2", "-x", "c"], run, tools)


def cpp(run: Run, tools: Tools) -> Told:
    return compiled(
        [program("c++"), "-std=c++14", "-Wall", "-Werror", "-O2", "-x", "c++"], run, tools
    )


def wasm(run: Run, tools: Tools) -> Told:
    node = program("node")
    path = tools.of_target(WASM, "hoid_ffi.wasm")
    return lines([node, HERE / "place.mjs", path], run, (path.stat().st_size, "module"))


def cortex(run: Run, tools: Tools) -> Told:
    emulator = program("qemu-system-arm")
    path = tools.of_target(CORTEX, "hoid-embedded")
    kept = list(run.lines())[: None if tools.whole else SHORT]
    (tools.folder / "run.csv").write_text("".join(kept), encoding="utf-8")
    config = ["-semihosting-config", "enable=on,target=native", "-kernel", path]
    text = output([emulator, "-M", "mps2-an386", "-nographic", *config], cwd=tools.folder)
    (tools.folder / "board.csv").write_text(text, encoding="utf-8")
    found = told.table(tools.folder / "board.csv")
    columns = tuple(name for name in found if name != "t")
    rows = np.array([found[name] for name in columns]).T
    # A line each second, from the first estimate on.
    first = round(found["t"][0] / told.STEP)
    at = range(first, first + 100 * len(rows), 100)
    return Told(rows, columns, at, size=flash(path))


def flash(path: Path) -> tuple[int, str] | None:
    try:
        sizes = output([program("size"), path]).splitlines()[1].split()
    except Missing:
        return None
    return int(sizes[0]) + int(sizes[1]), "flash"


PLACES: Iterable[Place] = (
    Place("`hoid track`", "a file as a whole", track),
    Place("`hoid stream`, a pipe", "a line and its answer", stream),
    Place("Rust, `hoid`", "a call", rust),
    Place("C, `libhoid`", "three calls", c),
    Place("C++, `libhoid`", "three calls", cpp),
    Place("WebAssembly (Node.js)", "three calls", wasm, other_functions=OF_LOOP),
    Place("Cortex-M4 (QEMU)", "a line", cortex, ("--nk", "29", "--replay", "0", "--guard", "no")),
)
