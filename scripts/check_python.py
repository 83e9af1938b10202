"""Refuse a Python that quad does not support before anything is compiled or installed.

setup.py, install_packages and make_venv run this file. It is plain enough for any Python, so that
an old one says the same. The versions are those of ``requires-python`` in ``pyproject.toml``.
pip would compile a physics engine without a wheel in silence: that is refused as well, unless
``QUAD_COMPILE`` is set.
"""

import os
import platform
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def supported():
    """Return the first version that is supported and the first that is not: ((3, 8), (3, 14))."""
    with open(os.path.join(ROOT, "pyproject.toml")) as file:
        found = re.search(r'^requires-python = ">=(\d+)\.(\d+),<(\d+)\.(\d+)"$', file.read(), re.M)
    first_major, first_minor, end_major, end_minor = map(int, found.groups())
    return (first_major, first_minor), (end_major, end_minor)


def refusal(version, executable):
    """Return why a Python of this version cannot be used and what to do, "" if it can be used."""
    first, end = supported()
    if first <= tuple(version[:2]) < end:
        return ""
    return (
        "quad: Python %d.%d at %s: expected Python %d.%d to %d.%d; for other versions there are no "
        "wheels of the physics engine, pybullet, and compiling it takes a quarter of an hour.\n"
        "Install quad with another Python, from its checkout:\n"
        "    uv tool install --python 3.11 .    # or uvx --python 3.11 --from . quad fly\n"
        "    conda create --name quad python=3.11 && conda activate quad && pip install .\n"
        "    QUAD_PYTHON=python3.11 make venv\n"
        "Flying with ROS takes the system's Python: use Debian 12 or 13, or a container:\n"
        "    docker build --tag quad ."
    ) % (version[0], version[1], executable, first[0], first[1], end[0], end[1] - 1)


def has_wheel(version, system, machine):
    """Return whether the physics engine has a wheel for a Python of this version."""
    first = {
        ("linux", "x86_64"): (3, 8),
        ("darwin", "arm64"): (3, 10),
        ("darwin", "x86_64"): (3, 11),
        ("win32", "amd64"): (3, 10),
    }.get((system, machine.lower()))
    end = (3, 13) if (system, machine) == ("darwin", "x86_64") else (3, 14)
    return first is not None and first <= tuple(version[:2]) < end


def main():
    """End the process with the reason if its Python cannot be used, or only with a compiler."""
    reason = refusal(sys.version_info, sys.executable)
    if reason:
        sys.exit(reason)
    if os.environ.get("QUAD_COMPILE") or has_wheel(
        sys.version_info, sys.platform, platform.machine()
    ):
        return
    sys.exit(
        "quad: the physics engine, pybullet, has no wheel for Python %d.%d on %s, %s. Compiling it"
        " takes a C++ compiler and a quarter of an hour; to do so, set the environment variable"
        " QUAD_COMPILE=1."
        % (sys.version_info[0], sys.version_info[1], platform.system(), platform.machine())
    )


if __name__ == "__main__":
    main()
