"""Where the scenes, goals and configurations are that come with the package.

In a checkout they stand beside ``src``; pip puts them below the environment's
``share/quad``, catkin below the workspace's.
"""

from __future__ import annotations

import sys
from pathlib import Path

from quad_nav.errors import InputError

_HERE = Path(__file__).resolve()
_PLACES = (
    _HERE.parents[3],
    Path(sys.prefix) / "share" / "quad",
    *(parent / "share" / "quad" for parent in list(_HERE.parents)[3:6]),
)


def shipped(kind: str, name: str = "") -> Path:
    """A shipped file or folder, as ``shipped("scenes", "arena.yaml")``.

    Raises:
        InputError: it is nowhere.
    """
    for place in _PLACES:
        path = place / kind / name
        if path.exists():
            return path
    raise InputError(
        [
            f"{kind}/{name}: does not come with quad; expected it in one of "
            + ", ".join(str(place / kind) for place in _PLACES)
        ]
    )
