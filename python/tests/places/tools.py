"""Built and installed programs and libraries."""

from __future__ import annotations

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .told import Missing

ROOT = Path(__file__).parents[3]
HERE = Path(__file__).parent


@dataclass(frozen=True)
class Tools:
    #: The program hoid; the other results of the build are next to it.
    binary: Path
    #: Working directory.
    folder: Path
    #: True for the table: QEMU processes the whole run, which takes a minute; otherwise only its
    #: first seconds.
    whole: bool = False
    #: True if the calling task has just built everything.
    built: bool = os.environ.get("HOID_PLACES_BUILT") is not None

    def hoid(self, *arguments: Any) -> str:
        return output([self.binary, *arguments])

    def shared_library(self) -> Path:
        names = ("libhoid_ffi.so", "libhoid_ffi.dylib", "hoid_ffi.dll")
        beside = self.binary.parent
        places = [place / name for place in (beside, beside / "deps") for name in names]
        return newest(places, "no shared library: cargo build -p hoid-ffi")

    def example(self, name: str) -> Path:
        path = self.binary.parent / "examples" / f"{name}{self.binary.suffix}"
        return newest([path], f"no example {name}: cargo build -p hoid --example {name}")

    def of_target(self, target: str, name: str) -> Path:
        """The build for another processor: in the profile of this program, or in release."""
        folder = self.binary.parents[1] / target
        profiles = (self.binary.parent.name, "release")
        places = [folder / profile / name for profile in profiles]
        found = newest(places, f"not built for {target}: cargo xtask python")
        # Older builds are not from these sources.
        if not self.built and found.stat().st_mtime < self.binary.stat().st_mtime:
            raise Missing(f"built for {target} before the program was: cargo xtask python")
        return found

    def shipped(self, path: Path) -> int:
        """Size of a file as distributed, in bytes."""
        return stripped(path, self.folder).stat().st_size


def stripped(path: Path, folder: Path) -> Path:
    """A program or library without its symbols, if `strip` is available."""
    strip = shutil.which("strip")
    if strip is None:
        return path
    small = folder / f"stripped-{path.name}"
    subprocess.run([strip, "-o", small, path], check=True)
    return small


def newest(places: list[Path], reason: str) -> Path:
    there = [path for path in places if path.exists()]
    if not there:
        raise Missing(reason)
    return max(there, key=lambda path: path.stat().st_mtime)


def program(*names: str) -> str:
    """The first of these programs that is installed."""
    for name in names:
        if (found := shutil.which(name)) is not None:
            return found
    raise Missing(f"there is no {' or '.join(names)}")


def output(command: list[Any], **options: Any) -> str:
    """The output of a program; its error message if it fails."""
    words = [str(word) for word in command]
    done = subprocess.run(words, capture_output=True, text=True, check=False, **options)
    assert done.returncode == 0, f"{words}: {done.stderr}"
    return done.stdout


def binary() -> Path:
    return Path(os.environ["HOID_BINARY"]).absolute()
