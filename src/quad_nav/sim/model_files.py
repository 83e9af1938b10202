"""Files that a Gazebo world names: models, meshes, and the map of the same place.

A name may begin with ``model://``, ``package://`` or ``file://``. It is looked for in the folders
of ``model_folders``, in their order.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import List, Optional, Sequence, Tuple

from quad_nav.errors import InputError
from quad_nav.files.user_files import read_bytes, referenced_file
from quad_nav.files.xml_tree import read_xml

_SCHEME = re.compile(r"^(model|package|file)://")
_LEVELS = 4  # folders above a world in which its package is looked for
_PATHS = ("GAZEBO_MODEL_PATH", "GAZEBO_RESOURCE_PATH", "GZ_SIM_RESOURCE_PATH", "ROS_PACKAGE_PATH")
_OWN_MODELS = Path("~/.gazebo/models")
_MAP_BYTES = 65_536


def model_path() -> List[Path]:
    """Return the folders of Gazebo's environment variables, and of the models it downloads."""
    named = os.pathsep.join(os.environ.get(name, "") for name in _PATHS)
    return [*(Path(one) for one in named.split(os.pathsep) if one), _OWN_MODELS.expanduser()]


def model_folders(world: Path) -> List[Path]:
    """Return the folders in which models of a world are, the most likely first.

    They are its own, ``models`` there and one level up, those of ``model_path``, and where the
    world is in a ROS package, the package, beside it, and ``models`` of the packages beside it.
    """
    folder = world.parent
    folders = [folder, folder / "models", folder.parent / "models", *model_path()]
    package = _package_of(world)
    if package is not None:
        beside = sorted(package.parent.glob("*/models"))
        folders += [package, package / "models", package.parent, *beside]
    return folders


def _package_of(path: Path) -> Optional[Path]:
    above = list(path.resolve().parents)[:_LEVELS]
    return next((one for one in above if (one / "package.xml").exists()), None)


def find_file(uri: str, folders: Sequence[Path], also: Sequence[Path] = ()) -> Optional[Path]:
    """Return the file or folder of a URI in the first folder that has it, None if none has.

    Raises:
        InputError: It leads out of the folders, and of those that a link may lead to, ``also``.
    """
    name = _SCHEME.sub("", uri.strip())
    if not name or "://" in name:
        return None
    for folder in folders:
        if os.path.exists(folder / name):  # Path.exists raises where a name is too long
            return referenced_file(folder, name, (*folders, *also))
    return None


def find_model(uri: str, folders: Sequence[Path]) -> Optional[Path]:
    """Return the SDF file of a model, None if there is none.

    ``model://name`` is a folder. Its ``model.config`` names the file, or several, of which the one
    with the highest version counts. Without ``model.config``, or with one that is no XML, it is
    ``model.sdf``.

    Raises:
        InputError: A link or a ``model.config`` leads out of the folders.
    """
    for folder in folders:
        place = find_file(uri, [folder], folders)
        if place is not None and place.is_dir():
            place = _sdf_in(place, folders)
        if place is not None and os.path.exists(place):
            return place
    return None


def _sdf_in(folder: Path, folders: Sequence[Path]) -> Path:
    config = folder / "model.config"
    try:
        files = list(read_xml(config).all("sdf")) if config.exists() else []
    except InputError:  # many have an & in their descriptions; Gazebo's own reader goes on, too
        files = []
    named = [(_version(sdf.attributes.get("version", "")), sdf.text.strip()) for sdf in files]
    return referenced_file(folder, max(named)[1] if named else "model.sdf", folders)


def _version(text: str) -> Tuple[int, ...]:
    return tuple(int(part) for part in text.split(".") if re.fullmatch("[0-9]{1,9}", part))


def find_map(world: Path) -> Optional[Path]:
    """Return a map of ``map_server`` in a folder ``map...`` of a world's package or beside it.

    The one with the world's name comes first.
    """
    package = _package_of(world) or world.resolve().parent.parent
    found = [*sorted(package.glob("map*/*.yaml")), *sorted(package.parent.glob("*/map*/*.yaml"))]
    found.sort(key=lambda one: one.stem not in world.stem)
    return next((one for one in found if _is_map(one)), None)


def _is_map(path: Path) -> bool:
    try:
        return re.search(rb"(?m)^image *:", read_bytes(path, _MAP_BYTES)) is not None
    except InputError:
        return False
