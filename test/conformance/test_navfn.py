"""NavFn against recordings of the original."""

from __future__ import annotations

import pytest
from families import cases, navfn


@pytest.mark.parametrize("path", cases("navfn"), ids=lambda path: path.stem)
def test_case(path):
    assert navfn.check(path) == []
