"""Tables as text and as HTML, and numbers with no more digits than their errors justify."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

__all__ = ["html_table", "number", "plain_table", "with_uncertainty"]

DASH = "–"


def number(value: float | None, digits: int = 5) -> str:
    """Format a number."""
    if value is None or math.isnan(value):
        return DASH
    if value == 0 or 1e-4 <= abs(value) < 1e6:
        return f"{value:.{digits}g}"
    return f"{value:.{digits - 1}e}"


def with_uncertainty(value: float, error: float | None) -> tuple[str, str]:
    """Format a value and its standard error: two digits of the error, the same decimals for the value."""
    if error is None or not math.isfinite(error) or error <= 0 or not math.isfinite(value):
        return number(value), DASH
    decimals = 1 - math.floor(math.log10(error))
    if -6 < decimals < 10:
        shown = max(decimals, 0)
        return f"{value:.{shown}f}", f"{error:.{shown}f}"
    return number(value), number(error, 2)


def plain_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Format a table as text: the first column is left-aligned, the others are right-aligned."""
    table = [list(header), *[list(row) for row in rows]]
    widths = [max(len(row[i]) for row in table) for i in range(len(header))]

    def line(row: Sequence[str]) -> str:
        cells = [
            row[0].ljust(widths[0]),
            *[cell.rjust(width) for cell, width in zip(row[1:], widths[1:])],
        ]
        return ("  ".join(cells)).rstrip()

    rule = "─" * (sum(widths) + 2 * (len(widths) - 1))
    return "\n".join([line(table[0]), rule, *[line(row) for row in table[1:]]])


def html_table(caption: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Format the same table as HTML, for notebooks."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)

    def line(row: Sequence[str]) -> str:
        first, *rest = row
        return (
            f"<tr><th>{escape(first)}</th>"
            + "".join(f"<td>{escape(cell)}</td>" for cell in rest)
            + "</tr>"
        )

    body = "".join(line(row) for row in rows)
    return (
        f"<table><caption>{escape(caption)}</caption>"
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )
