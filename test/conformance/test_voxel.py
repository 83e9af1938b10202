"""Clouds to voxels and master grids, against the original's, bit for bit."""

from __future__ import annotations

import pytest
from families import cases, layered


@pytest.mark.parametrize("path", cases("voxel"), ids=lambda path: path.stem)
def test_case(path):
    assert layered.check(path) == []
