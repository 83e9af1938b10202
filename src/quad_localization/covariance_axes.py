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
        if k != i:
            diagonal[[i, k]], axes[:, [i, k]] = diagonal[[k, i]], axes[:, [k, i]]
    return axes, diagonal


def _tridiagonal(matrix: Floats) -> Tuple[Floats, Floats, Floats]:
    """Reduce a symmetric matrix: return the transformation, the diagonal and the one beside it."""
    v, d, e = matrix.astype(np.float64), matrix[2].astype(np.float64), np.zeros(3)
    for i in (2, 1):
        scale, h = float(np.sum(np.abs(d[:i]))), 0.0
        if scale == 0.0:
            e[i] = d[i - 1]
            d[:i] = v[i - 1, :i]
            v[i, :i] = v[:i, i] = 0.0
        else:
            d[:i] /= scale
            h = float(np.sum(d[:i] * d[:i]))
            f = d[i - 1]
            g = -math.sqrt(h) if f > 0 else math.sqrt(h)
            e[i] = scale * g
            h -= f * g
            d[i - 1] = f - g
            v[:i, i] = d[:i]
            lower = np.tril(v[:i, :i])
            e[:i] = (lower + np.tril(lower, -1).T) @ d[:i] / h
            e[:i] -= np.sum(e[:i] * d[:i]) / (h + h) * d[:i]
            for j in range(i):
                v[j:i, j] -= d[j] * e[j:i] + e[j] * d[j:i]
                d[j] = v[i - 1, j]
                v[i, j] = 0.0
        d[i] = h
    for i in range(2):
        v[2, i], v[i, i] = v[i, i], 1.0
        h, n = d[i + 1], i + 1
        if h != 0.0:
            d[:n] = v[:n, n] / h
            v[:n, :n] -= np.outer(d[:n], v[:n, n] @ v[:n, :n])
        v[:n, n] = 0.0
    diagonal = v[2].copy()
    v[2] = (0.0, 0.0, 1.0)
    return v, diagonal, e


def _diagonalize(v: Floats, d: Floats, e: Floats) -> None:
    """Rotate until the diagonal ``d`` has the eigenvalues and ``v`` the axes, in place."""
    e[:2], e[2] = e[1:].copy(), 0.0
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
