"""`python -m places`: the table, on standard output."""

from __future__ import annotations

import tempfile
from pathlib import Path

from .table import tables
from .tools import Tools, binary

with tempfile.TemporaryDirectory() as folder:
    print(tables(Tools(binary(), Path(folder), whole=True)))
