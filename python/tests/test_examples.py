"""Every public function and class has an example, and those of the methods run."""

from __future__ import annotations

import doctest
import inspect
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest

import pyhoid


def examples(text: str | None) -> list[doctest.Example]:
    return doctest.DocTestParser().get_examples(text or "")


def public() -> Iterator[Any]:
    for module in (pyhoid, pyhoid.plots):
        for name in module.__all__:
            found = getattr(module, name)
            if callable(found) and not (isinstance(found, type) and issubclass(found, Exception)):
                yield found


def methods(of: Any) -> Iterator[tuple[str, Any]]:
    for name, found in vars(of).items():
        found = getattr(found, "__func__", found)
        if isinstance(found, FunctionType) and not name.startswith("_"):
            yield name, found


def test_every_public_name_has_an_example_that_parses() -> None:
    for one in public():
        assert examples(one.__doc__), one
        for example in examples(one.__doc__):
            compile(example.source, one.__name__, "exec")


def test_every_method_has_an_example_that_runs(
    c1: pyhoid.Record,
    c4: pyhoid.Record,
    fit: pyhoid.Fit,
    group_results: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("control")
    pytest.importorskip("xarray")
    monkeypatch.chdir(tmp_path)
    c1.to_pandas().rename(columns={"e": "error"}).to_csv("run1.csv")
    c1.to_polars().rename({"e": "error"}).write_ipc("run1.arrow")
    names = {
        "pyhoid": pyhoid,
        "record": c1,
        "fit": fit,
        "described": pyhoid.describing_function([c1, pyhoid.simulate("C1", seed=2)]),
        "person": pyhoid.identify_operator(c1, form="lead"),
        "change": pyhoid.identify(c4, change="sigmoid"),
        "trace": pyhoid.track(c4, "physical", nk=29, nd=1, every=64),
        "tracker": pyhoid.Tracker("physical", nk=29, nd=1, record=c1),
        "found": pyhoid.compare(group_results),
        "designed": pyhoid.design(controlled_element="4/s"),
        "results": pyhoid.study("noise-level", "study", replications=1),
        "pandas": pytest.importorskip("pandas"),
        "polars": pytest.importorskip("polars"),
    }
    count = 0
    for one in filter(inspect.isclass, public()):
        for name, method in methods(one):
            found = examples(method.__doc__)
            assert found, f"{one.__name__}.{name}"
            known = dict(names)
            for example in found:
                exec(compile(example.source, f"{one.__name__}.{name}", "exec"), known)
            count += 1
    assert count > 40, count
