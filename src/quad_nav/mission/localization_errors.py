"""Errors of the poses that robots believe, against the true ones."""

from __future__ import annotations

import math
from typing import Any, Dict, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray


def pose_errors(believed: NDArray[np.float64], true: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the errors float64[n, 2], in m and rad, of poses float64[n, 3] (x_m, y_m, yaw_rad)."""
    errors = believed - true
    turns_rad = np.abs(np.remainder(errors[:, 2] + math.pi, 2.0 * math.pi) - math.pi)
    return np.column_stack([np.hypot(errors[:, 0], errors[:, 1]), turns_rad])


def error_figures(errors: Sequence[NDArray[Any]]) -> Dict[str, Any]:
    """Return the medians and 95th percentiles of ``pose_errors``, rounded to 1 mm and 1 mrad.

    There must be at least one error.
    """
    (middle_m, middle_rad), (high_m, high_rad) = np.percentile(
        np.concatenate(errors), [50, 95], axis=0
    ).tolist()
    return {
        "position_error_m": {"median": round(middle_m, 3), "p95": round(high_m, 3)},
        "yaw_error_rad": {"median": round(middle_rad, 3), "p95": round(high_rad, 3)},
    }


def error_note(figures: Mapping[str, Any]) -> str:
    """Return ``error_figures`` as a line for people."""
    far, turned = (figures[name] for name in ("position_error_m", "yaw_error_rad"))
    return (
        f"Localization: {far['median']:.3f} m and {turned['median']:.3f} rad from the truth, in"
        f" 95 % of the time below {far['p95']:.3f} m and {turned['p95']:.3f} rad."
    )
