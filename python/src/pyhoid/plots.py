"""Figures with matplotlib in the style of hoid's reports, on new or existing axes.

The hue identifies the model or method (blue, vermillion, green, ... of Okabe and Ito); black is the
true or the measured signal. Bands extend two standard errors to each side (`deviations`), error
bars extend one. Every function returns the axes on which it has drawn.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import matplotlib.pyplot as plt
import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes

from .description import DescribingFunction, Description
from .errors import OptionError
from .estimates import unit_of
from .fit import Fit
from .operator_fit import OperatorFit
from .record import Record
from .trace import Trace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "COLOURS",
    "STYLE",
    "bode",
    "box_plots",
    "describing",
    "reference",
    "residual_tests",
    "style",
    "time_response",
    "trace",
]

#: Colours of models in the order of the reports: blue, vermillion, green, purple, orange, sky blue.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
GREY = "#999999"
GRID = "#e4e4e4"
BAND = 0.22

#: The style of the reports, for ``matplotlib.rc_context`` or ``plt.style.use``.
STYLE: Mapping[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["Helvetica", "Arial", "Liberation Sans", "DejaVu Sans"],
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "figure.dpi": 120,
    "savefig.dpi": 150,
}

#: Symbols of the parameters in figures.
SYMBOLS: Mapping[str, str] = {
    "K_e": r"$K_e$",
    "T_L": r"$T_L$",
    "K_e_dot": r"$K_{\dot e}$",
    "omega_nm": r"$\omega_{nm}$",
    "zeta_nm": r"$\zeta_{nm}$",
    "tau_e": r"$\tau_e$",
    "T_n": r"$T_n$",
    "K_n": r"$K_n$",
    "gain_db": r"$|H|$",
    "phase_deg": r"$\angle H$",
    "crossover_rad_s": r"$\omega_c$",
    "phase_margin_deg": r"$\varphi_m$",
}


@contextmanager
def style() -> Iterator[None]:
    """Draw in the style of the reports: ``with pyhoid.plots.style(): ...``.

    Examples
    --------
    >>> with pyhoid.plots.style():
    ...     pyhoid.plots.bode(fit)
    """
    # Only the style's own settings are restored: matplotlib.rc_context would also undo what the backend
    # of a notebook sets at the first figure.
    settings: Any = rcParams
    before = {name: settings[name] for name in STYLE}
    settings.update(STYLE)
    try:
        yield
    finally:
        settings.update(before)


def _axes(ax: Axes | None, size: tuple[float, float] = (5.6, 3.2)) -> Axes:
    if ax is not None:
        return ax
    _, made = plt.subplots(figsize=size, layout="constrained")
    return made


def _label(name: str, unit: str | None = None) -> str:
    unit = unit_of(name) if unit is None else unit
    quantity, _, omega = name.partition("@")
    symbol = SYMBOLS.get(quantity, quantity)
    if omega:
        symbol += f" at {omega} rad/s"
    return f"{symbol} ({unit})" if unit else symbol


#: A model that can be drawn: a fit, or the operator of a person.
Model: TypeAlias = Fit | OperatorFit


def _fits(fits: Model | Mapping[str, Model] | Sequence[Model]) -> dict[str, Fit]:
    if isinstance(fits, (Fit, OperatorFit)):
        fits = [fits]
    if not isinstance(fits, Mapping):
        fits = {_title(fit): fit for fit in fits}
    # An operator is represented by its polynomial model.
    return {name: fit.fit if isinstance(fit, OperatorFit) else fit for name, fit in fits.items()}


def _title(fit: Model) -> str:
    return fit.form if isinstance(fit, OperatorFit) else fit._native.title


def time_response(
    fits: Fit | Mapping[str, Fit] | Sequence[Fit],
    record: Record | None = None,
    *,
    predict: bool = False,
    ax: Axes | None = None,
) -> Axes:
    """Draw the measured output and the response of one or more models.

    Parameters
    ----------
    fits : Fit, sequence or mapping from names to Fit
    record : Record, optional
        By default the first record of the first fit.
    predict : bool
        True draws the one-step prediction instead of the simulation.

    Examples
    --------
    >>> pyhoid.plots.time_response(fit, record)
    """
    named = _fits(fits)
    record = record or next(iter(named.values())).records[0]
    with style():
        ax = _axes(ax)
        ax.plot(record.time, record.u, color="black", linewidth=0.9, label="measured")
        for colour, (name, fit) in zip(_cycle(), named.items()):
            found = fit.predict(record) if predict else fit.simulate(record)
            vaf = fit.quality_on(record)["vaf_prediction" if predict else "vaf_simulation"]
            ax.plot(
                record.time[found.first :],
                found.values,
                color=colour,
                label=f"{name}, VAF {vaf:.1f} %",
            )
        ax.set_xlabel("t (s)")
        unit = record.units.get(record.output_name, "")
        ax.set_ylabel(f"{record.output_name} ({unit})" if unit else record.output_name)
        ax.margins(x=0)
        _legend(ax)
    return ax


def _legend(ax: Axes) -> None:
    """Draw a legend above the axes, where it hides no curve."""
    handles, labels = ax.get_legend_handles_labels()
    if handles:
        columns = 1 if max(map(len, labels)) > 34 and len(labels) > 2 else min(len(handles), 3)
        ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=columns, borderaxespad=0.2)


def _cycle() -> Iterator[str]:
    while True:
        yield from COLOURS


def _unwrapped(phase_deg: Any) -> Any:
    return np.rad2deg(np.unwrap(np.deg2rad(phase_deg)))


def bode(
    fits: Model | Mapping[str, Model] | Sequence[Model],
    omega: Any = None,
    *,
    axes: Sequence[Axes] | None = None,
    deviations: float = 2.0,
) -> Sequence[Axes]:
    """Draw a Bode plot from e to u with bands of `deviations` standard errors.

    Models are fits or operators of people. `axes` are two axes, for magnitude and phase.

    Examples
    --------
    >>> pyhoid.plots.bode({"BJ": fit, "ARX": other})
    """
    with style():
        pair = _pair(axes)
        for colour, (name, fit) in zip(_cycle(), _fits(fits).items()):
            found = fit.frequency_response(omega)
            phase = _unwrapped(found.phase_deg)
            for ax, middle, error, label in (
                (pair[0], found.magnitude_db, found.magnitude_db_se, name),
                (pair[1], phase, found.phase_deg_se, None),
            ):
                ax.plot(found.omega, middle, color=colour, label=label)
                band = deviations * np.nan_to_num(error)
                ax.fill_between(
                    found.omega, middle - band, middle + band, color=colour, alpha=BAND, linewidth=0
                )
        _dress_bode(pair)
    return pair


def _pair(axes: Sequence[Axes] | None) -> Sequence[Axes]:
    if axes is None:
        _, made = plt.subplots(2, 1, figsize=(5.0, 4.6), sharex=True, layout="constrained")
        return list(made)
    if len(axes) != 2:
        raise OptionError(f"axes has {len(axes)} axes, expected two: magnitude and phase")
    return axes


def _dress_bode(pair: Sequence[Axes]) -> None:
    for ax in pair:
        ax.set_xscale("log")
        ax.margins(x=0)
        # The curves set the scale, since the band is unbounded where a response vanishes.
        _limits(ax, [np.asarray(line.get_ydata(), dtype=float) for line in ax.get_lines()])
    pair[0].set_ylabel("magnitude (dB)")
    pair[1].set_ylabel("phase (deg)")
    pair[1].set_xlabel("ω (rad/s)")
    _legend(pair[0])


def describing(
    found: DescribingFunction | Description,
    model: Model | Mapping[str, Model] | Sequence[Model] | None = None,
    *,
    axes: Sequence[Axes] | None = None,
) -> Sequence[Axes]:
    """Draw the describing function as points with error bars, over the Bode plot of the models.

    `found` is the result of `describe` or `describing_function`.

    Examples
    --------
    >>> pyhoid.plots.describing(pyhoid.describe(records))
    """
    if isinstance(found, Description):
        found = found.function
    with style():
        pair = _pair(axes)
        if model is not None:
            omega = np.geomspace(found.omega.min() / 1.5, found.omega.max() * 1.5, 200)
            bode(model, omega, axes=pair)
        for ax, name, label in (
            (pair[0], "magnitude_db", "describing function"),
            (pair[1], "phase_deg", None),
        ):
            values = found[name] if name == "magnitude_db" else _unwrapped(found[name])
            bars = np.nan_to_num(found[f"{name}_se"])
            ax.errorbar(
                found.omega,
                values,
                yerr=bars,
                fmt="o",
                color="black",
                markersize=3.5,
                linewidth=0.9,
                capsize=2,
                label=label,
                zorder=3,
            )
        _dress_bode(pair)
    return pair


def residual_tests(
    fit: Fit, record: Record | None = None, *, axes: Sequence[Axes] | None = None
) -> Sequence[Axes]:
    """Draw the autocorrelation of the residuals and their cross-correlation with e.

    The grey bands are the bounds within which 99 % of the values for white residuals lie.

    Examples
    --------
    >>> pyhoid.plots.residual_tests(fit, record)
    """
    record = record or fit.records[0]
    found = fit.validate(record)
    with style():
        if axes is None:
            _, made = plt.subplots(2, 1, figsize=(5.6, 4.2), layout="constrained")
            axes = list(made)
        panels = (
            (axes[0], found.autocorrelation, "autocorrelation of ε"),
            (axes[1], found.cross_correlation, "correlation of ε with e"),
        )
        for ax, correlation, name in panels:
            ax.axhspan(
                -correlation.bound_99, correlation.bound_99, color=GREY, alpha=BAND, linewidth=0
            )
            ax.vlines(correlation.lags, 0, correlation.values, color=COLOURS[0], linewidth=1.0)
            ax.axhline(0, color="black", linewidth=0.8)
            ax.set_ylabel(name)
            ax.margins(x=0.01)
        axes[1].set_xlabel("lag (samples)")
        test = found.ljung_box
        if test is not None:
            axes[0].set_title(
                f"Ljung-Box Q = {test['statistic']:.1f}, {test['degrees_of_freedom']} degrees of"
                f" freedom, p = {test['p_value']:.3f}",
                loc="left",
            )
    return axes


def trace(
    traces: Trace | Mapping[str, Trace] | Sequence[Trace],
    names: Sequence[str] | None = None,
    *,
    axes: Sequence[Axes] | None = None,
    truth: bool = True,
    deviations: float = 2.0,
) -> Sequence[Axes]:
    """Draw parameters over time, one per panel, with bands of `deviations` standard errors.

    Parameters
    ----------
    traces : Trace, sequence or mapping from names to Trace
    names : sequence of str, optional
        Columns to draw; by default the operator's parameters.
    truth : bool
        True draws the true values in black if the record contains them.

    Examples
    --------
    >>> pyhoid.plots.trace(pyhoid.track(record))
    """
    if isinstance(traces, Trace):
        named = {traces.method: traces}
    elif isinstance(traces, Mapping):
        named = dict(traces)
    else:
        named = {one.method: one for one in traces}
    first = next(iter(named.values()))
    shown = list(names or first.response_names or first.operator_names)
    with style():
        if axes is None:
            _, made = plt.subplots(
                len(shown),
                1,
                figsize=(5.6, 1.35 * len(shown) + 0.5),
                sharex=True,
                layout="constrained",
                squeeze=False,
            )
            axes = list(made[:, 0])
        if len(axes) != len(shown):
            raise OptionError(
                f"axes has {len(axes)} axes, expected {len(shown)}:"
                f" one for each of {', '.join(shown)}"
            )
        for ax, name in zip(axes, shown):
            extent: list[Any] = []
            for colour, (label, one) in zip(_cycle(), named.items()):
                middle, band = one[name], deviations * np.nan_to_num(one[f"{name}_se"])
                ax.plot(one.time, middle, color=colour, label=label)
                ax.fill_between(
                    one.time, middle - band, middle + band, color=colour, alpha=BAND, linewidth=0
                )
                moved = one.time >= one.updated_from
                extent.append(middle[moved & np.isfinite(middle)])
            if truth and name in first.record.channels:
                known = first.record[name]
                ax.plot(
                    first.record.time,
                    known,
                    color="black",
                    linestyle="--",
                    linewidth=0.9,
                    label="truth",
                )
                extent.append(known)
            _limits(ax, extent)
            ax.set_ylabel(_label(name, first._unit(name)))
            ax.margins(x=0)
            _mark_changes(ax, named.values(), words=ax is axes[0])
        axes[-1].set_xlabel("t (s)")
        _legend(axes[0])
    return axes


def _mark_changes(ax: Axes, traces: Iterable[Trace], *, words: bool) -> None:
    """Draw a dashed line and a label where a change was declared."""
    for change in (change for one in traces for change in one.changes):
        ax.axvline(change["t"], color="#444444", linestyle=(0, (6, 3)), linewidth=0.9)
        if words:
            what = [SYMBOLS.get(name, name) for name in change["changed"]]
            ax.annotate(
                ", ".join(what) or "the response",
                (change["t"], 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(2, 2),
                textcoords="offset points",
                fontsize=7,
            )


def _limits(ax: Axes, extent: Iterable[Any]) -> None:
    """Set limits with room for nearly all of the curves.

    Single values near a vanishing gain do not set the scale.
    """
    parts = [np.asarray(part)[np.isfinite(part)] for part in extent]
    values = np.concatenate(parts) if parts else np.array([])
    if values.size:
        low, high = np.quantile(values, [0.005, 0.995])
        room = 0.25 * (high - low) or 0.1 * abs(high) or 1.0
        ax.set_ylim(low - room, high + room)


def box_plots(
    groups: Mapping[str, Any],
    *,
    truth: float | None = None,
    label: str = "",
    ax: Axes | None = None,
) -> Axes:
    """Draw box plots of samples by name.

    They show the median, the quartiles, whiskers of up to 1.5 interquartile ranges, and all other values
    as points.

    Parameters
    ----------
    groups : mapping from str to array_like
        Values that are not finite are left out; their number is given below the name.
    truth : float, optional
        The true value, drawn as a dashed line.
    label : str
        Label of the ordinate; a parameter's name becomes its symbol and unit.

    Examples
    --------
    >>> pyhoid.plots.box_plots({"ARX": [0.08, 0.09, 0.11], "BJ": [0.09, 0.10]}, truth=0.09)
    """
    with style():
        ax = _axes(ax)
        samples, names = [], []
        for name, values in groups.items():
            array = np.asarray(values, dtype=float)
            lost = int(np.sum(~np.isfinite(array)))
            samples.append(array[np.isfinite(array)])
            names.append(f"{name}\n({lost} without value)" if lost else name)
        boxes = ax.boxplot(
            samples,
            patch_artist=True,
            widths=0.55,
            medianprops={"color": "black"},
            flierprops={"marker": ".", "markersize": 3, "markeredgecolor": GREY},
        )
        for colour, box in zip(_cycle(), boxes["boxes"]):
            box.set_facecolor(colour)
            box.set_alpha(0.55)
        ax.set_xticks(range(1, len(names) + 1), names)
        if truth is not None:
            ax.axhline(truth, color="black", linestyle="--", linewidth=0.9)
        ax.set_ylabel(_label(label) if label else "")
        ax.grid(visible=False, axis="x")
    return ax


def reference(name: str, directory: str | PathLike[str]) -> Figure:
    """Draw a figure of the reproduction of the thesis from its data.

    Parameters
    ----------
    name : str
        ``"fig-11"``, ``"C.1"``, ``"A.1"``, ...; ``hoid reproduce --list`` shows all names.
    directory : path
        The directory that ``hoid reproduce --out`` wrote.

    Raises
    ------
    FileMissingError
        If the figure has not been reproduced in that directory.

    Examples
    --------
    >>> pyhoid.plots.reference("fig-11", "reproduction")
    """
    from . import _reference

    return _reference.draw(name, Path(directory))
