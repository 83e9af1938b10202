"""Find the scenes, goals and configurations that come with the package.

In a checkout they are beside ``src``; pip installs them below the environment's ``share/quad``,
catkin below the workspace's.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import List

from quad_nav.errors import InputError
from quad_nav.files.values import nearest

_HERE = Path(__file__).resolve()
_PLACES = (
    _HERE.parents[3],
    Path(sys.prefix) / "share" / "quad",
    *(parent / "share" / "quad" for parent in list(_HERE.parents)[3:6]),
)


def shipped(folder: str, name: str = "") -> Path:
    """Path of a shipped file or folder, as ``shipped("scenes", "arena.yaml")``.

    Raises:
        InputError: It is in none of the places where it may be installed.
    """
    for place in _PLACES:
        path = place / folder / name
        if path.exists():
            return path
    raise InputError(
        [
            f"{folder}/{name}: does not come with quad; expected it in one of "
            + ", ".join(str(place / folder) for place in _PLACES)
        ]
    )


def is_shipped(name: str) -> bool:
    """Return whether a configuration of this name comes with the package."""
    return name in config_names()


def config_names() -> List[str]:
    """List the names of the shipped configurations."""
    return sorted(
        path.stem for path in shipped("config").iterdir() if path.is_dir() or path.suffix == ".yaml"
    )


def config_folder(name: str) -> Path:
    """Folder of a configuration: a folder's path or the name of a shipped configuration.

    A shipped configuration may also be a file, an overlay on the folder ``default`` beside it.

    Raises:
        InputError: There is neither.
    """
    path = Path(name).expanduser()
    if path.is_dir():
        return path
    names = config_names()
    if name in names:
        folder = shipped("config") / name
        return folder if folder.is_dir() else folder.with_suffix(".yaml")
    near = nearest(name, names)
    hint = f"did you mean {near}?" if near else f"there are {', '.join(names)}"
    raise InputError(
        [
            f"config: {name}: expected a folder, a YAML file, a launch file, or the name of a"
            f" shipped one; {hint}"
        ]
    )
