"""Figures of the reproduction of the thesis, drawn from the tables stored next to them.

The columns of a table determine the kind of figure: box plots over nk and the noise level, maps over
nk and m, Bode plots, estimates over time, or curves.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import to_rgb

from . import _text, plots
from .errors import FileMissingError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Columns = Mapping[str, Any]

#: Columns that determine the curve to which a row belongs.
KEYS = (
    "model",
    "estimator",
    "parameter",
    "quantity",
    "name",
    "remnant_order",
    "noise_level",
    "nk",
    "nd",
    "m",
)


def draw(name: str, directory: Path) -> Figure:
    """Draw the figure with this name."""
    files = {file.stem.lower(): file for file in sorted((directory / "figures").glob("*.csv"))}
    file = files.get(name.lower())
    if file is None:
        known = ", ".join(sorted(files)) or "none"
        raise FileMissingError(
            f"{directory} has no data for {name}, only for: {known};"
            f" write them with hoid reproduce --only {name} --out {directory}"
        )
    columns = _columns(file)
    with plots.style():
        if {"t", "median", "estimator"} <= columns.keys():
            figure = _traces(columns)
        elif {"lower_quartile", "median", "parameter", "nk"} <= columns.keys():
            figure = _boxes(columns)
        elif {"quantity", "m", "nk", "value"} <= columns.keys():
            figure = _maps(columns)
        elif {"omega_rad_s", "magnitude_db", "phase_deg"} <= columns.keys():
            figure = _bode(columns)
        else:
            figure = _curves(columns)
        figure.suptitle(name, x=0.005, ha="left", fontsize=9)
    return figure


def _columns(file: Path) -> dict[str, Any]:
    rows = list(
        csv.reader(
            line
            for line in file.read_text(encoding="utf-8").splitlines()
            if not line.startswith("#")
        )
    )
    header, body = rows[0], rows[1:]
    columns: dict[str, Any] = {}
    for i, name in enumerate(header):
        cells = [row[i] for row in body]
        try:
            columns[name] = np.array([float(cell) if cell else np.nan for cell in cells])
        except ValueError:
            columns[name] = np.array(cells, dtype=object)
    return columns


def _each(columns: Columns, name: str) -> list[Any]:
    """Return the distinct values of a column in order, without missing values."""
    found = columns[name].tolist() if name in columns else []
    return [value for value in dict.fromkeys(found) if value == value] or [None]


def _rows(columns: Columns, **wanted: Any) -> Any:
    mask = np.ones(len(next(iter(columns.values()))), dtype=bool)
    for name, value in wanted.items():
        # A row without the key, such as that of the true values, belongs to every value of the key.
        if value is not None:
            mask &= (columns[name] == value) | (columns[name] != columns[name])
    return mask


def _shades(hue: str, levels: int) -> list[Any]:
    """Return shades of a hue from light to dark."""
    rgb = np.array(to_rgb(hue))
    shares = np.linspace(-1, 1, levels) if levels > 1 else [0.0]
    return [tuple(rgb + (1 - rgb) * -0.55 * s if s < 0 else rgb * (1 - 0.6 * s)) for s in shares]


def _grid(
    rows: int, columns: int, width: float, height: float, **options: Any
) -> tuple[Figure, Any]:
    size = (width * columns + 0.7, height * rows + 0.7)
    figure, grid = plt.subplots(
        rows, columns, figsize=size, squeeze=False, layout="constrained", **options
    )
    return figure, grid


def _legend(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 6))


def _order_titles(grid: Any, orders: list[Any]) -> None:
    for ax, order in zip(grid[0], orders):
        if order is not None:
            ax.set_title(f"m0 = {order:g}")


#: Hue and dashes of estimators, by the start of their names. Batch fits use those of their method.
LINES: Mapping[str, tuple[str, str]] = {
    "RLS": (plots.COLOURS[0], "-"),
    "OLS": (plots.COLOURS[0], "--"),
    "ARX": (plots.COLOURS[0], "-"),
    "RPEM": (plots.COLOURS[1], "-"),
    "PEM": (plots.COLOURS[1], "--"),
    "BJ": (plots.COLOURS[1], "-"),
}


def _line(name: str, other: str) -> tuple[str, str]:
    return next((line for start, line in LINES.items() if name.startswith(start)), (other, "-"))


def _is_truth(name: object) -> bool:
    return name in ("truth", "true", "simulated")


def _traces(columns: Columns) -> Figure:
    parameters, estimators, orders, levels = (
        _each(columns, name) for name in ("parameter", "estimator", "remnant_order", "noise_level")
    )
    figure, grid = _grid(len(parameters), len(orders), 2.5, 1.35, sharex=True)
    for row, parameter in enumerate(parameters):
        for column, order in enumerate(orders):
            ax, extent = grid[row][column], []
            for hue, estimator in zip(plots._cycle(), estimators):
                if _is_truth(estimator):
                    mask = _rows(
                        columns, parameter=parameter, estimator=estimator, remnant_order=order
                    )
                    ax.plot(
                        columns["t"][mask],
                        columns["median"][mask],
                        color="black",
                        linestyle="--",
                        linewidth=0.9,
                        label="simulated",
                    )
                    extent.append(columns["median"][mask])
                    continue
                hue, dashes = _line(estimator, hue)
                for colour, level in zip(_shades(hue, len(levels)), levels):
                    mask = _rows(
                        columns,
                        parameter=parameter,
                        estimator=estimator,
                        remnant_order=order,
                        noise_level=level,
                    )
                    label = None if dashes == "--" else f"{estimator}, {level:g}"
                    ax.plot(
                        columns["t"][mask],
                        columns["median"][mask],
                        dashes,
                        color=colour,
                        linewidth=0.9,
                        label=label,
                    )
                    extent.append(columns["median"][mask])
            plots._limits(ax, extent)
            ax.margins(x=0)
        grid[row][0].set_ylabel(plots._label(parameter))
    _order_titles(grid, orders)
    for ax in grid[-1]:
        ax.set_xlabel("t (s)")
    _legend(figure, grid[0][0])
    return figure


def _boxes(columns: Columns) -> Figure:
    parameters, orders, delays, levels = (
        _each(columns, name) for name in ("parameter", "remnant_order", "nk", "noise_level")
    )
    ends = ("lower_whisker", "upper_whisker") if "lower_whisker" in columns else ("least", "most")
    figure, grid = _grid(len(parameters), len(orders), 2.5, 1.35, sharex=True)
    colours = _shades(plots.COLOURS[1 if "f1" in parameters else 0], len(levels))
    width = 0.8 / len(levels)
    for row, parameter in enumerate(parameters):
        for column, order in enumerate(orders):
            ax = grid[row][column]
            for at, (colour, level) in enumerate(zip(colours, levels)):
                mask = np.flatnonzero(
                    _rows(columns, parameter=parameter, remnant_order=order, noise_level=level)
                )
                found = [
                    {
                        "med": columns["median"][k],
                        "q1": columns["lower_quartile"][k],
                        "q3": columns["upper_quartile"][k],
                        "whislo": columns[ends[0]][k],
                        "whishi": columns[ends[1]][k],
                    }
                    for k in mask
                ]
                x_positions = [
                    delays.index(columns["nk"][k]) + (at - (len(levels) - 1) / 2) * width
                    for k in mask
                ]
                boxes = ax.bxp(
                    found,
                    positions=x_positions,
                    widths=0.85 * width,
                    patch_artist=True,
                    showfliers=False,
                    showcaps=False,
                    medianprops={"color": "black", "linewidth": 0.8},
                    boxprops={"linewidth": 0.5},
                    whiskerprops={"linewidth": 0.6},
                    manage_ticks=False,
                )
                for box in boxes["boxes"]:
                    box.set_facecolor(colour)
                ax.plot([], [], color=colour, linewidth=4, label=f"{level:g}")
            ax.axhline(0, color="black", linewidth=0.6, zorder=0)
            ax.set_xticks(range(len(delays)), [f"{nk:g}" for nk in delays])
        grid[row][0].set_ylabel(plots._label(parameter, ""))
    _order_titles(grid, orders)
    for ax in grid[-1]:
        ax.set_xlabel("nk*")
    _legend(figure, grid[0][0])
    return figure


def _maps(columns: Columns) -> Figure:
    quantities, levels = _each(columns, "quantity"), _each(columns, "noise_level")
    figure, grid = _grid(len(quantities), len(levels), 2.1, 1.7, sharex=True, sharey=True)
    delays, orders = (np.unique(columns[name]) for name in ("nk", "m"))
    for row, quantity in enumerate(quantities):
        of_all = columns["value"][_rows(columns, quantity=quantity)]
        low, high = np.nanmin(of_all), np.nanmax(of_all)
        mesh = None
        for ax, level in zip(grid[row], levels):
            values = np.full((len(orders), len(delays)), np.nan)
            for k in np.flatnonzero(_rows(columns, quantity=quantity, noise_level=level)):
                values[
                    np.searchsorted(orders, columns["m"][k]),
                    np.searchsorted(delays, columns["nk"][k]),
                ] = columns["value"][k]
            mesh = ax.pcolormesh(
                delays, orders, values, cmap="cividis", vmin=low, vmax=high, shading="nearest"
            )
            ax.set_xticks(delays)
            ax.set_yticks(orders)
            ax.grid(visible=False)
            if row == 0:
                ax.set_title(f"$P_n$ = {level:g}")
        grid[row][0].set_ylabel("m*")
        if mesh is not None:
            figure.colorbar(mesh, ax=list(grid[row]), label=str(quantity))
    for ax in grid[-1]:
        ax.set_xlabel("nk*")
    return figure


def _bode(columns: Columns) -> Figure:
    orders = _each(columns, "remnant_order")
    shade = max(("noise_level", "nk"), key=lambda name: len(_each(columns, name)))
    levels = _each(columns, shade)
    figure, grid = _grid(2, len(orders), 2.4, 1.9, sharex=True, sharey="row")
    for column, order in enumerate(orders):
        for other, model in zip(plots._cycle(), _each(columns, "model")):
            hue, _ = ("#000000", "--") if _is_truth(model) else _line(str(model), other)
            shown = [None] if _is_truth(model) else levels
            for colour, level in zip(_shades(hue, len(shown)), shown):
                mask = _rows(columns, model=model, remnant_order=order, **{shade: level})
                label = str(model) if level is None else f"{model}, {level:g}"
                for ax, name in ((grid[0][column], "magnitude_db"), (grid[1][column], "phase_deg")):
                    values = (
                        columns[name][mask]
                        if name == "magnitude_db"
                        else plots._unwrapped(columns[name][mask])
                    )
                    dashes = "--" if _is_truth(model) else "-"
                    ax.plot(
                        columns["omega_rad_s"][mask],
                        values,
                        dashes,
                        color=colour,
                        linewidth=0.9,
                        label=label,
                    )
                    ax.set_xscale("log")
                    ax.margins(x=0)
        grid[1][column].set_xlabel("ω (rad/s)")
    grid[0][0].set_ylabel("magnitude (dB)")
    grid[1][0].set_ylabel("phase (deg)")
    _order_titles(grid, orders)
    _legend(figure, grid[0][0])
    return figure


def _curves(columns: Columns) -> Figure:
    numbers = [name for name, values in columns.items() if values.dtype != object]
    abscissa = next(
        (name for name in ("t", "omega_rad_s", "demanded") if name in numbers), numbers[0]
    )
    keys = [
        name
        for name in columns
        if name != abscissa and (columns[name].dtype == object or name in KEYS)
    ]
    left = [
        name
        for name in numbers
        if name not in (abscissa, *keys, "runs", "sd") and not name.endswith("_se")
    ]
    figure, grid = _grid(len(left), 1, 5.0, 1.8, sharex=True)
    groups = list(dict.fromkeys(zip(*(columns[key].tolist() for key in keys)))) if keys else [()]
    for ax, name in zip(grid[:, 0], left):
        for colour, group in zip(plots._cycle(), groups):
            mask = _rows(columns, **dict(zip(keys, group)))
            label = ", ".join(
                v if isinstance(v, str) else f"{key} {_text.number(v, 3)}"
                for key, v in zip(keys, group)
            )
            errors = columns.get(f"{name}_se")
            ax.errorbar(
                columns[abscissa][mask],
                columns[name][mask],
                yerr=None if errors is None else errors[mask],
                color=colour,
                marker="." if mask.sum() < 20 else None,
                capsize=2,
                label=label or None,
            )
        ax.set_ylabel(plots._label(name))
        if abscissa == "omega_rad_s":
            ax.set_xscale("log")
    grid[-1][0].set_xlabel("ω (rad/s)" if abscissa == "omega_rad_s" else plots._label(abscissa))
    if 1 < len(groups) <= 12:
        _legend(figure, grid[0][0])
    return figure
