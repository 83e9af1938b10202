"""The inflation layer against the original's, cost for cost."""

from __future__ import annotations

import pytest
from families import cases, inflation


@pytest.mark.parametrize("path", cases("inflation"), ids=lambda path: path.stem)
def test_case(path):
    assert inflation.check(path) == []
