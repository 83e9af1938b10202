"""Load the library of compiled kernels, with which a process needs neither numba nor LLVM.

``build_library`` makes it where there is a C compiler. The library holds machine code for the
processor that it was built on, and serves only the sources that it was built from. Where there is
none, and for arguments of types that it does not hold, numba compiles the kernels.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sysconfig
from importlib.machinery import ExtensionFileLoader
from pathlib import Path
from types import ModuleType
from typing import FrozenSet, List, Optional, Tuple

import quad_nav
from quad_nav.errors import printable
from quad_nav.files.cache_folder import require_writable, user_cache_folder

MODULE = "quad_kernels"
SOURCES = Path(__file__).resolve().parent
_CPU_INFO = Path("/proc/cpuinfo")


def find_cache_folder() -> Tuple[Optional[Path], List[str]]:
    """Return the folder for compiled kernels, None if none can be written, and why not others.

    The first of: ``NUMBA_CACHE_DIR``; ``__pycache__`` beside the kernels, with the trust that the
    sources have; a folder of this user.
    """
    given = os.environ.get("NUMBA_CACHE_DIR", "")
    problems = []
    for folder in ([Path(given)] if given else []) + [SOURCES / "__pycache__"]:
        try:
            os.makedirs(folder, exist_ok=True)
            require_writable(folder)
        except OSError as error:
            problems.append(f"{folder}: {error.strerror or error}")
        else:
            return folder, problems
    name = hashlib.sha256(os.fsencode(SOURCES)).hexdigest()[:12]  # of this installation
    own, others = user_cache_folder(name)
    return own, problems + others


def find_digest() -> str:
    """Return a hash of everything that compiled kernels hold: they call each other."""
    digest = hashlib.sha256(quad_nav.__version__.encode())
    for path in [*sorted(SOURCES.glob("*.py")), *SOURCES.glob("*.c"), SOURCES.parent / "grid.py"]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def cpu_flags() -> FrozenSet[str]:
    """Return the features of the processor that the kernel names, empty where it names none."""
    try:
        with _CPU_INFO.open(encoding="ascii", errors="replace") as lines:
            for line in lines:  # the first processor's: the others are like it
                name, _, flags = line.partition(":")
                if name.strip() in ("flags", "Features"):
                    return frozenset(flags.split())
    except OSError:
        pass
    return frozenset()


def library_path(folder: Path) -> Path:
    """Return the file of the library for the present sources and this Python."""
    return folder / f"{MODULE}-{DIGEST[:16]}{sysconfig.get_config_var('EXT_SUFFIX')}"


def load_library() -> Tuple[Optional[ModuleType], str]:
    """Return the library and "", or None and the reason why numba compiles the kernels."""
    if os.environ.get("QUAD_KERNELS") == "numba":
        return None, "QUAD_KERNELS=numba is set"
    for name in sorted(os.environ):
        if name.startswith("NUMBA_") and name != "NUMBA_CACHE_DIR":
            return None, f"{name} is set"
    # The folder beside the sources may belong to another user, who installed sources and library.
    folders = [SOURCES / "__pycache__"] if not os.environ.get("NUMBA_CACHE_DIR") else []
    for folder in [*folders, *([FOLDER] if FOLDER else [])]:
        path = library_path(folder)
        if path.exists():
            return _load(path)
    return None, "it is not built for these sources (`make workspace` builds it)"


def _load(path: Path) -> Tuple[Optional[ModuleType], str]:
    loader = ExtensionFileLoader(MODULE, str(path))
    spec = importlib.util.spec_from_loader(MODULE, loader)
    assert spec is not None
    try:
        module = importlib.util.module_from_spec(spec)
        loader.exec_module(module)
    except (ImportError, RuntimeError) as error:  # damaged, or for another numpy
        return None, printable(f"{path.name}: {error}")
    missing = frozenset(module.cpu_flags.split()) - cpu_flags()
    if missing or not module.cpu_flags:
        lacks = " ".join(sorted(missing)) or "named features"
        return None, f"it was built on another processor: this one lacks {lacks}"
    return module, ""


FOLDER, PROBLEMS = find_cache_folder()
DIGEST = find_digest()
