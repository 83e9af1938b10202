"""Every family against recordings of the original, case by case."""

from __future__ import annotations

import pytest
from families import FAMILIES, cases


@pytest.mark.parametrize(
    "family, path",
    [
        pytest.param(family, path, id=f"{family}-{path.stem}")
        for family in FAMILIES
        for path in cases(family)
    ],
)
def test_case(family, path):
    assert FAMILIES[family](path) == []
