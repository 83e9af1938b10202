"""Results of many flights as text and CSV, and the interval of a rate."""

from __future__ import annotations

import csv
import io
import math
import textwrap
from typing import Any, Mapping, Optional, Sequence, Tuple

import tabulate

from quad_nav.versions import versions

WIDTH = 96
_Z = 1.959963984540054
"""Two-sided 95 % quantile of the normal distribution."""


def wilson_interval(successes: int, trials: int) -> Tuple[float, float]:
    """Return Wilson's 95 % score interval of a rate, for independent trials.

    Source: E. B. Wilson, "Probable inference, the law of succession, and statistical inference",
    Journal of the American Statistical Association 22, 1927.
    """
    rate, weight = successes / trials, _Z * _Z / trials
    centre = (rate + weight / 2) / (1 + weight)
    half = _Z * math.sqrt(rate * (1 - rate) / trials + weight / (4 * trials)) / (1 + weight)
    return max(0.0, centre - half), min(1.0, centre + half)


def percent(count: int, trials: int) -> str:
    """Format a rate in percent."""
    return f"{100 * count / trials:.1f}"


def interval_text(interval: Tuple[float, float]) -> str:
    """Format the interval of a rate in percent."""
    return f"{100 * interval[0]:.1f}-{100 * interval[1]:.1f}"


def number_text(value: Optional[float], decimals: int = 1) -> str:
    """Format a number; None is a dash."""
    return "-" if value is None else f"{value:.{decimals}f}"


def rounded(value: Optional[float]) -> Optional[float]:
    """Round a number for JSON and CSV; None stays."""
    return None if value is None else round(value, 4)


def table(rows: Sequence[Sequence[str]], header: Sequence[str], names: int = 1) -> str:
    """Format rows of a table, of which the first ``names`` columns are names."""
    return tabulate.tabulate(
        rows,
        header,
        tablefmt="simple",
        disable_numparse=True,
        colalign=("left",) * names + ("right",) * (len(header) - names),
    )


def wrapped(head: str, lines: Sequence[str]) -> str:
    """Format indented paragraphs below a line for a terminal of 100 columns."""
    paragraphs = (
        textwrap.fill(line, WIDTH, initial_indent="  ", subsequent_indent="    ") for line in lines
    )
    return "\n".join([head, *paragraphs])


def paragraphs(lines: Sequence[str]) -> str:
    """Wrap each line for a terminal of 100 columns."""
    return "\n".join(textwrap.fill(line, WIDTH) for line in lines)


def interruption(flown: int, wanted: int) -> Sequence[str]:
    """Return a line about flights that were not flown, if there are any."""
    return [f"Interrupted after {flown} of {wanted} flights."] if flown < wanted else []


def versions_text() -> str:
    """Return the versions of what computes a flight in one line."""
    return ", ".join(f"{name} {version}" for name, version in versions().items())


def csv_text(rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> str:
    """Return rows as CSV, with a header."""
    file = io.StringIO()
    writer = csv.DictWriter(file, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return file.getvalue().rstrip("\n")
