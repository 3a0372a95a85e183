"""The interfaces of hoid: one run through each, its estimates, and the time per sample.

A place takes e and u of 82 s of C4, a sample at a time, and reports the operator after each.
``test_places.py`` compares all of them with `hoid track`, to the last digit; ``python -m places``
(by ``cargo xtask places``) writes the table of the book. What a place needs and is not here makes
it `Missing`, with the reason.

| file | holds |
|---|---|
| ``told.py`` | the output of a place, and its comparison |
| ``tools.py`` | what is built and installed |
| ``programs.py`` | programs that read lines: `hoid`, Rust, C, C++, WebAssembly, Cortex-M4 |
| ``within.py`` | what runs within this process: Python, functional mock-up units |
| ``sockets.py`` | UDP, LabStreamingLayer |
| ``table.py`` | the table |
| ``place.c``, ``place.mjs`` | what the places in C, C++ and JavaScript run |
"""

from __future__ import annotations

from . import programs, sockets, within
from .told import Missing, Place, Run, Told
from .tools import Tools

__all__ = ["PLACES", "Missing", "Place", "Run", "Told", "Tools"]

PLACES: tuple[Place, ...] = (*programs.PLACES, *within.PLACES, *sockets.PLACES)
