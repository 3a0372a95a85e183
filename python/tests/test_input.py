"""Arguments of users: each is accepted, or the message states the problem."""

from __future__ import annotations

import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import pyhoid

N = 600


def values(seed: int = 0) -> Any:
    return np.random.default_rng(seed).normal(size=N)


def expected() -> pyhoid.Record:
    return pyhoid.Record(e=values(), u=values(1), sample_time=0.01)


@pytest.mark.parametrize(
    "of",
    [
        lambda x: x.tolist(),
        lambda x: tuple(x.tolist()),
        lambda x: x.astype(">f8"),
        lambda x: np.repeat(x, 2)[::2],
        lambda x: np.asfortranarray(np.stack([x, x], axis=1))[:, 1],
        lambda x: x[::-1][::-1],
        lambda x: pd.Series(x, index=np.arange(N)[::-1]),
        lambda x: pd.Series(x, index=pd.date_range("2024-01-01", periods=N, freq="10ms")),
        lambda x: np.ma.masked_invalid(x),
        lambda x: x.astype(object),
    ],
    ids=[
        "list",
        "tuple",
        "big-endian",
        "strided",
        "column",
        "reversed twice",
        "series",
        "series with times",
        "unmasked",
        "objects",
    ],
)
def test_each_of_these_is_the_same_signal(of: Any) -> None:
    record = pyhoid.Record(e=of(values()), u=of(values(1)), sample_time=0.01)
    known = expected()
    np.testing.assert_array_equal(record.e, known.e)
    a, b = (pyhoid.identify(r, "arx", na=2, nb=2, nk=1) for r in (record, known))
    assert a.parameters == b.parameters


def test_other_numbers_are_converted() -> None:
    whole = (values() * 100).round()
    for dtype in (np.float32, np.int16, np.int64, np.float16):
        record = pyhoid.Record(e=whole.astype(dtype), u=values(1), sample_time=0.01)
        np.testing.assert_array_equal(record.e, whole)


@pytest.mark.parametrize(
    ("e", "message"),
    [
        (np.ma.masked_greater(values(), 1.0), "masked values, the first at sample"),
        (values().reshape(2, -1), r"shape \(2, 300\), expected one dimension"),
        (values()[:, None], r"write .ravel\(\)"),
        (values() + 1j, "complex128, expected real numbers"),
        (np.array(["a"] * N), "expected real numbers"),
        (values()[:-1], "channel u has 600 samples, expected 599"),
        (np.where(np.arange(N) == 7, np.nan, values()), "channel e: the value at sample 7 is NaN"),
        (np.where(np.arange(N) == 7, np.inf, values()), "channel e: the value at sample 7 is inf"),
        ([None] * N, "at sample 0 is NaN"),
        ([object()] * N, "not a number"),
        ([], "no samples"),
        (3.0, "expected one dimension"),
    ],
)
def test_what_is_wrong_is_said(e: Any, message: str) -> None:
    with pytest.raises(pyhoid.DataError, match=message) as caught:
        pyhoid.Record(e=e, u=values(1), sample_time=0.01)
    assert isinstance(caught.value, ValueError) and isinstance(caught.value, pyhoid.Error)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"structure": "x"}, 'structure is "x"'),
        ({"nd": 1.5}, "expected whole numbers"),
        ({"nd": (3, 1)}, "the smaller first"),
        ({"nk": range(5, 20, 2)}, "step 1"),
        ({"structure": "grey-box", "nk": 29}, 'nk applies only to method="pem"'),
        ({"instruments": "f_t"}, "instruments applies only to method"),
        ({"method": "iv4", "structure": "bj"}, "fits only the structure arx"),
        ({"start": {"f1": 1.0}, "nk": 29, "nd": 1}, "start lacks"),
        ({"start": {"f1": 1.0}}, "single model"),
        ({"fix": {"d1": "x"}}, "d1: a number"),
        ({"fix": {"q7": 0.0}, "nk": 29, "nd": 1}, "q7"),
        ({"bound": {"b0": (1, 0)}, "nk": 29, "nd": 1}, "bound: found b0"),
        ({"criterion": "best"}, "criterion: found best"),
        ({"progress": 3}, "progress is 3"),
    ],
)
def test_options_that_have_no_meaning(
    c1: pyhoid.Record, keywords: dict[str, Any], message: str
) -> None:
    with pytest.raises(pyhoid.OptionError, match=message) as caught:
        pyhoid.identify(c1, **keywords)
    assert isinstance(caught.value, ValueError)
    # The message contains no option of the command line.
    assert "--" not in str(caught.value)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"method": "nothing"}, 'method is "nothing"'),
        ({"method": "rls", "bound": {"K_e": (0, 1)}}, "bound applies only to"),
        ({"method": "rpem", "memory": 0.5}, "memory"),
        ({"method": "rpem", "forgetting_factor": 1.5}, "above 0 and up to 1"),
        ({"method": "rpem", "forgetting": "random-walk"}, "without drift"),
        ({"start": "somewhere"}, "expected all coefficients"),
        ({"update_from": 1e6}, "the record ends"),
        ({"every": 0}, "expected 1 or more"),
        ({"moving_average": -1.0}, "moving_average"),
    ],
)
def test_recursions_that_have_no_meaning(
    c1: pyhoid.Record, keywords: dict[str, Any], message: str
) -> None:
    with pytest.raises(pyhoid.OptionError, match=message):
        pyhoid.track(c1, **keywords)


def test_other_errors(c1: pyhoid.Record, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as missing:
        pyhoid.read(tmp_path / "nothing.csv")
    assert isinstance(missing.value, pyhoid.FileError) and isinstance(missing.value, OSError)
    with pytest.raises(pyhoid.FileError):
        pyhoid.write(tmp_path / "no" / "where.csv", c1)
    with pytest.raises(pyhoid.FormatError):
        pyhoid.write(tmp_path / "a.xyz", c1)
    (tmp_path / "gap.csv").write_text("t,e,u\n0,1,2\n0.01,,3\n0.02,1,2\n")
    with pytest.raises(pyhoid.FormatError, match="fill=True"):
        pyhoid.read(tmp_path / "gap.csv")
    with pytest.raises(pyhoid.DataError, match="expected a pyhoid.Record"):
        pyhoid.identify([np.zeros(3)])  # type: ignore[list-item]
    with pytest.raises(pyhoid.DataError, match="expected a pyhoid.Record"):
        pyhoid.identify(3)  # type: ignore[arg-type]
    with pytest.raises(pyhoid.DataError):
        pyhoid.identify(c1.span(0, 0.1), nk=3)
    with pytest.raises(pyhoid.Error):
        pyhoid.identify(
            pyhoid.Record(e=np.zeros(500), u=np.zeros(500), sample_time=0.01), "arx", nk=1
        )
    with pytest.raises(pyhoid.OptionError):
        pyhoid.Record(e=values(), u=values(1), sample_time=-1)
    with pytest.raises(pyhoid.OptionError):
        pyhoid.simulate("C9")
    with pytest.raises(pyhoid.OptionError):
        pyhoid.simulate()
    with pytest.raises(pyhoid.DataError, match="there are no samples"):
        c1.span(100, 200)
    with pytest.raises(KeyError, match="there is no channel"):
        _ = c1["nothing"]
    with pytest.warns(UserWarning, match="text.csv"):
        (tmp_path / "text.csv").write_text(
            "t,e,u,who\n" + "".join(f"{k / 100},{k % 7},{k % 5},me\n" for k in range(50))
        )
        pyhoid.read(tmp_path / "text.csv")


def test_arrays_that_nobody_can_change_are_not_copied() -> None:
    """Records and spans of them are views, and an update reads the arrays."""
    n = 2_000_000
    e, u = (np.random.default_rng(k).normal(size=n) for k in (0, 1))
    e.flags.writeable = u.flags.writeable = False
    tracker = pyhoid.Tracker("rls", structure="arx", na=1, nb=1, nk=1, start="nothing")
    tracemalloc.start()
    try:
        record = pyhoid.Record(e=e, u=u, sample_time=0.01)
        part = record.span(10, 19_000)
        made = tracemalloc.get_traced_memory()[1]
        tracemalloc.reset_peak()
        tracker.update(e, u)
        updated = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    # The interpreter does not count the memory of the module, so the largest resident size of a
    # separate process is measured.
    program = (
        "import resource, numpy, pyhoid\n"
        "e, u = (numpy.random.default_rng(k).normal(size=4_000_000) for k in (0, 1))\n"
        "t = pyhoid.Tracker('rls', structure='arx', na=1, nb=1, nk=1, start='nothing')\n"
        "t.update(e[:9], u[:9])\n"
        "e.flags.writeable = u.flags.writeable = False\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "pyhoid.Record(e=e, u=u, sample_time=0.01)\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)\n"
    )
    if sys.platform == "linux":
        grown = int(
            subprocess.run(
                [sys.executable, "-c", program], capture_output=True, text=True, check=True
            ).stdout
        )
        assert grown < 8_000, "kB; a copy of one array would be 32 000"
    assert np.shares_memory(record.e, e) and np.shares_memory(part.u, u)
    assert not record.u.flags.writeable
    assert made < 1e6
    # Only the innovations are newly allocated.
    assert updated < 1.2 * e.nbytes


def test_nothing_changes_behind_the_back_of_a_record() -> None:
    e, u = values(), values(1)
    record = pyhoid.Record(e=e, u=u, sample_time=0.01, d=e)
    before = np.array(record.e)
    e[:] = 0.0
    assert record.e is not None and (record.e == before).all()
    assert (record["d"] == before).all()
    for array in (record.u, record.e, record["d"], record.span(0, 0.1).u):
        assert not array.flags.writeable
        with pytest.raises(ValueError, match="WRITEABLE"):
            array.flags.writeable = True


def test_a_record_does_not_change_under_a_fit(c1: pyhoid.Record) -> None:
    with pytest.raises(ValueError, match="read-only"):
        c1.u[0] = 1.0
