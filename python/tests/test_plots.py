"""Figures on new and on given axes, and their contents."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

import pyhoid
from pyhoid import plots


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    yield
    plt.close("all")


def lines(ax: Any) -> list[str]:
    return [line.get_label() for line in ax.get_lines()]


def drawn(ax: Any, tmp_path: Path) -> None:
    file = tmp_path / "figure.png"
    ax.figure.savefig(file)
    assert file.stat().st_size > 5000


def test_time_response(fit: pyhoid.Fit, c1: pyhoid.Record, tmp_path: Path) -> None:
    arx = pyhoid.identify(c1, "arx", nk=29)
    ax = plots.time_response({"ARX": arx, "Box-Jenkins": fit}, c1.span(10, 30))
    assert lines(ax)[0] == "measured" and lines(ax)[1].startswith("ARX, VAF")
    assert [line.get_color() for line in ax.get_lines()[1:]] == list(plots.COLOURS[:2])
    drawn(ax, tmp_path)
    given = plt.figure().add_subplot()
    assert fit.plot(ax=given) is given


def test_bode_and_describing_function(fit: pyhoid.Fit, c1: pyhoid.Record, tmp_path: Path) -> None:
    magnitude, phase = plots.bode(fit, np.geomspace(0.1, 50, 40))
    assert magnitude.get_xscale() == "log" and phase.get_ylabel() == "phase (deg)"
    assert len(magnitude.collections) == 1
    found = pyhoid.describing_function(
        [pyhoid.simulate("C1", seed=2, replication=k) for k in range(3)]
    )
    axes = plots.describing(found, {"BJ": fit})
    assert "describing function" in axes[0].get_legend_handles_labels()[1]
    drawn(axes[0], tmp_path)
    described = pyhoid.describe(c1, excitation="f_t")
    points = plots.describing(described)[0].get_lines()[0]
    assert np.array_equal(points.get_ydata(), described.function["magnitude_db"])
    with pytest.raises(pyhoid.OptionError):
        plots.bode(fit, axes=[magnitude])


def test_the_curves_set_the_scale_of_a_bode_plot(fit: pyhoid.Fit) -> None:
    magnitude, _ = plots.bode(fit, np.geomspace(0.1, 300, 60))
    values = magnitude.get_lines()[0].get_ydata()
    low, high = magnitude.get_ylim()
    # Bands of hundreds of dB above pi/Ts are not drawn.
    assert high - low < 1.6 * np.ptp(values) + 1e-9


def test_an_operator_is_drawn_as_a_fit_is(fit: pyhoid.Fit, c1: pyhoid.Record) -> None:
    person = pyhoid.identify_operator(c1, form="lead", nd=2, excitation="none")
    magnitude, _ = pyhoid.plots.bode([person, fit])
    assert [line.get_label() for line in magnitude.lines] == ["lead", fit._native.title]
    alone, _ = pyhoid.plots.bode(person)
    response = person.fit.frequency_response(None).magnitude_db
    assert np.array_equal(alone.lines[0].get_ydata(), response)
    bare = pyhoid.Record(e=c1.e, u=c1.u, sample_time=0.01, d=c1["f_t"])
    with pytest.raises(pyhoid.OptionError, match="channel is f_t, but the records have d"):
        pyhoid.describing_function(bare)


def test_residuals(fit: pyhoid.Fit, tmp_path: Path) -> None:
    axes = plots.residual_tests(fit)
    assert "Ljung-Box" in axes[0].get_title(loc="left")
    drawn(axes[1], tmp_path)


def test_traces(c4: pyhoid.Record, tmp_path: Path) -> None:
    both = {name: pyhoid.track(c4, name, nk=29, nd=1, every=10) for name in ("physical", "rpem")}
    axes = plots.trace(both, ["K_e", "K_e_dot"])
    assert lines(axes[0]) == ["physical", "rpem", "truth"] and "K_e" in axes[0].get_ylabel()
    low, high = axes[0].get_ylim()
    assert -0.2 < low < 0.07 and 0.09 < high < 0.4
    drawn(axes[0], tmp_path)
    assert len(both["rpem"].plot()) == 5


def test_a_trace_of_a_person(c4: pyhoid.Record, tmp_path: Path) -> None:
    trace = pyhoid.track(c4, at=[2.5], controlled_element="90/(s(s+6))", every=20)
    axes = trace.plot()
    labels = [ax.get_ylabel() for ax in axes]
    assert len(axes) == len(trace.response_names) == 4
    assert "at 2.5 rad/s (dB)" in labels[0] and "rad/s" in labels[2] and "deg" in labels[3]
    # One line for each declared change, in addition to those of the trace.
    assert len(trace.changes) >= 1 and all(
        len(ax.lines) == 1 + len(trace.changes) for ax in axes
    )
    drawn(axes[0], tmp_path)


def test_boxes(tmp_path: Path) -> None:
    samples = np.random.default_rng(0).normal(0.09, 0.002, size=(2, 100))
    samples[1, :3] = np.nan
    ax = plots.box_plots({"ARX": samples[0], "BJ": samples[1]}, truth=0.09, label="K_e")
    assert [text.get_text() for text in ax.get_xticklabels()] == ["ARX", "BJ\n(3 without value)"]
    assert ax.get_ylabel() == "$K_e$", "a gain has a unit only where its record reports it"
    drawn(ax, tmp_path)


def test_the_style_stays_where_it_belongs(fit: pyhoid.Fit) -> None:
    before = plt.rcParams["font.size"]
    plots.bode(fit)
    assert plt.rcParams["font.size"] == before


def test_a_reference_figure(tmp_path: Path, cli: Any) -> None:
    cli.run("reproduce", "--only", "fig-3", "--out", tmp_path)
    figure = plots.reference("fig-3", tmp_path)
    assert figure.get_axes() and figure.get_suptitle() == "fig-3"
    with pytest.raises(FileNotFoundError, match="fig-5"):
        plots.reference("fig-5", tmp_path)
