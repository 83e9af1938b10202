"""Where Gazebo's ``model://`` addresses are looked for."""

from __future__ import annotations

import os
import re
from pathlib import Path, PurePosixPath
from typing import Optional, Sequence

from quad_nav.files.user_files import referenced_file
from quad_nav.sim.xml_tree import read_xml

_SCHEME = "model://"


def find_model(uri: str, folders: Sequence[Path]) -> Optional[Path]:
    """The SDF file of a model, from the first folder that has it; None if none has.

    ``model://name`` is a folder whose ``model.config`` names the file, the one with the
    highest version if it names several; without it the file is ``model.sdf``. Addresses
    that lead out of the folders are not found. Raises ``InputError`` for links and
    ``model.config``s that do.
    """
    name = PurePosixPath(uri[len(_SCHEME) :] if uri.startswith(_SCHEME) else uri)
    if "://" in str(uri[len(_SCHEME) :]) or name.is_absolute() or ".." in name.parts:
        return None
    if not name.parts:
        return None
    for folder in folders:
        place = folder / name
        if not os.path.exists(place):  # Path.exists raises where a name is too long
            continue
        referenced_file(folder, str(name), folders)
        path = _sdf_in(place, folders) if place.is_dir() else place
        if os.path.exists(path):
            return path
    return None


def _sdf_in(folder: Path, folders: Sequence[Path]) -> Path:
    config = folder / "model.config"
    if not config.exists():
        return folder / "model.sdf"
    named = [
        (_version(sdf.attributes.get("version", "")), sdf.text.strip())
        for sdf in read_xml(config).all("sdf")
    ]
    return referenced_file(folder, max(named)[1] if named else "model.sdf", folders)


def _version(text: str) -> tuple:
    return tuple(int(part) for part in text.split(".") if re.fullmatch("[0-9]{1,9}", part))
