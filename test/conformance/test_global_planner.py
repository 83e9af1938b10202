"""The global planner against recordings of the original."""

from __future__ import annotations

import pytest
from families import cases, global_planner


@pytest.mark.parametrize("path", cases("global_planner"), ids=lambda path: path.stem)
def test_case(path):
    assert global_planner.check(path) == []
