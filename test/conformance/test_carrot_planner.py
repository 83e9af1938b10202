"""The carrot planner against recordings of the original."""

from __future__ import annotations

import pytest
from families import carrot_planner, cases


@pytest.mark.parametrize("path", cases("carrot_planner"), ids=lambda path: path.stem)
def test_case(path):
    assert carrot_planner.check(path) == []
