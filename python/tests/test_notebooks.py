"""The notebooks run from top to bottom and print their stored output.

They are kept with their output, so that they can be read where nothing runs. After a change
`HOID_UPDATE_DOCS=1 cargo xtask python tests/test_notebooks.py` renews it.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))
#: Largest size of a notebook with its pictures, bytes.
MOST = 250_000


def texts(notebook: Any) -> list[str]:
    """The output of each cell as one text, without pictures."""
    found = []
    for cell in notebook.cells:
        parts = []
        for output in cell.get("outputs", []):
            data = output.get("data", {})
            if not any(kind.startswith("image/") for kind in data):
                parts += (output.get("text") or data.get("text/plain", "")).split()
        found.append(" ".join(parts))
    return found


def as_kept(notebook: Any) -> Any:
    """The text without parts that differ between machines or runs."""
    notebook.metadata.pop("language_info", None)
    for number, cell in enumerate(notebook.cells):
        cell["id"] = f"cell-{number}"
        cell["metadata"] = {}
    return notebook


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_runs(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # The notebook contains its pictures, as in an interactive run.
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    kept = nbformat.read(file, as_version=4)
    notebook = nbformat.read(file, as_version=4)
    NotebookClient(
        notebook,
        timeout=120,
        kernel_name="python3",
        resources={"metadata": {"path": str(tmp_path)}},
    ).execute()
    # A warning is part of the text that a reader sees.
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            assert output.get("name") != "stderr", output["text"]
    if os.environ.get("HOID_UPDATE_DOCS"):
        nbformat.write(as_kept(notebook), file)
        kept = notebook
    assert texts(kept) == texts(notebook), "renew the output: HOID_UPDATE_DOCS=1"
    pictures = [
        kind for cell in kept.cells for o in cell.get("outputs", []) for kind in o.get("data", {})
    ]
    assert "image/png" in pictures, "a notebook shows a picture"
    assert file.stat().st_size < MOST, "smaller pictures: plt.rcParams['figure.dpi']"


def test_there_are_six() -> None:
    assert len(NOTEBOOKS) == 6
