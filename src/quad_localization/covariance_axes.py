"""Axes of a covariance in the order and with the signs that amcl's particles have.

Source: the symmetric eigenvalue routine of JAMA (public domain), after "tred2" and "tql2" of
EISPACK; Householder reduction to three diagonals, then implicit QL. numpy's routine returns the
same axes with other signs, which would be other particles.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def covariance_axes(covariance: Floats) -> Tuple[Floats, Floats]:
    """Return the axes, columns of float64[3, 3], and eigenvalues float64[3], ascending."""
    axes, diagonal, beside = _tridiagonal(covariance)
    _diagonalize(axes, diagonal, beside)
    for i in range(2):
        k = i + int(np.argmin(diagonal[i:]))
        diagonal[[i, k]], axes[:, [i, k]] = diagonal[[k, i]], axes[:, [k, i]]
    return axes, diagonal


def _tridiagonal(matrix: Floats) -> Tuple[Floats, Floats, Floats]:
    """Mirror a symmetric matrix: return the transformation, the diagonal and the one beside it."""
    axes, block, last = np.eye(3), matrix[:2, :2], matrix[2, :2]
    length = math.hypot(*last)
    if length > 0.0:  # mirror the last row onto its second axis
        length = -length if last[1] > 0.0 else length
        normal = np.array((last[0], last[1] - length))
        mirror = np.eye(2) - 2.0 / (normal @ normal) * np.outer(normal, normal)
        axes[:2, :2], block = mirror, mirror @ block @ mirror
    if block[1, 0] != 0.0:
        axes[:2, 0] *= -1.0
    diagonal = np.array((block[0, 0], block[1, 1], matrix[2, 2]))
    return axes, diagonal, np.array((-block[1, 0], length, 0.0))


def _diagonalize(v: Floats, d: Floats, e: Floats) -> None:
    """Rotate until the diagonal ``d`` has the eigenvalues and ``v`` the axes, in place."""
    shift, largest, eps = 0.0, 0.0, 2.0**-52
    for k in range(3):
        largest = max(largest, abs(d[k]) + abs(e[k]))
        m = next(m for m in range(k, 3) if abs(e[m]) <= eps * largest)
        while m > k:
            shift += _rotate(v, d, e, k, m)
            if abs(e[k]) <= eps * largest:
                break
        d[k] += shift
        e[k] = 0.0


def _rotate(v: Floats, d: Floats, e: Floats, k: int, m: int) -> float:
    """Do one implicit QL step from row m up to row k; return the shift of the eigenvalues."""
    g = d[k]
    p = (d[k + 1] - g) / (2.0 * e[k])
    r = -math.sqrt(p * p + 1.0) if p < 0 else math.sqrt(p * p + 1.0)
    d[k], d[k + 1] = e[k] / (p + r), e[k] * (p + r)
    behind, shift = d[k + 1], g - d[k]
    d[k + 2 :] -= shift
    p, c, c2, c3, s, s2, beside = d[m], 1.0, 1.0, 1.0, 0.0, 0.0, e[k + 1]
    for i in range(m - 1, k - 1, -1):
        c3, c2, s2 = c2, c, s
        g, h = c * e[i], c * p
        r = math.sqrt(p * p + e[i] * e[i])
        e[i + 1] = s * r
        s, c = e[i] / r, p / r
        p = c * d[i] - s * g
        d[i + 1] = h + s * (c * g + s * d[i])
        high = v[:, i + 1].copy()
        v[:, i + 1] = s * v[:, i] + c * high
        v[:, i] = c * v[:, i] - s * high
    p = -s * s2 * c3 * beside * e[k] / behind
    e[k], d[k] = s * p, c * p
    return float(shift)
