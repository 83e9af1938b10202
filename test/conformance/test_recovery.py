"""Recovery behaviours, against the original's, cell for cell."""

from __future__ import annotations

import pytest
from families import cases, recovery


@pytest.mark.parametrize("path", cases("recovery"), ids=lambda path: path.stem)
def test_case(path):
    assert recovery.check(path) == []
