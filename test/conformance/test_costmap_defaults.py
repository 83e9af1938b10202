"""Values of an empty parameter tree, compared with upstream."""

from __future__ import annotations

import pytest
from families import cases, defaults


@pytest.mark.parametrize("path", cases("defaults"), ids=lambda path: path.stem)
def test_defaults(path):
    assert defaults.check(path) == []
