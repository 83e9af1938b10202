"""Maps to master grids, against the original's, cell for cell."""

from __future__ import annotations

import pytest
from families import cases, layered


@pytest.mark.parametrize("path", cases("static"), ids=lambda path: path.stem)
def test_case(path):
    assert layered.check(path) == []
