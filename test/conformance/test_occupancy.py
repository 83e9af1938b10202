"""Footprints and published occupancies against the original's."""

from __future__ import annotations

import pytest
from families import cases, occupancy


@pytest.mark.parametrize("path", cases("occupancy"), ids=lambda path: path.stem)
def test_case(path):
    assert occupancy.check(path) == []
