"""The trajectory planner against recordings of the original."""

from __future__ import annotations

import pytest
from families import cases, trajectory_planner


@pytest.mark.parametrize("path", cases("trajectory_planner"), ids=lambda path: path.stem)
def test_case(path):
    assert trajectory_planner.check(path) == []
