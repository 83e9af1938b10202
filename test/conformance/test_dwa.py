"""The dynamic window planner against recordings of the original."""

from __future__ import annotations

import pytest
from families import cases, dwa


@pytest.mark.parametrize("path", cases("dwa"), ids=lambda path: path.stem)
def test_case(path):
    assert dwa.check(path) == []
