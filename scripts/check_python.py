"""Refuse a Python that quad does not support before anything is compiled or installed.

setup.py and make_venv run this file. It is plain enough for any Python, so that an old one says the
same. The supported versions are those of ``requires-python`` in ``pyproject.toml``.
"""

import os
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
        "    uv tool install --python 3.11 .  # or try it: uvx --python 3.11 --from . quad fly\n"
        "    conda create --name quad python=3.11 && conda activate quad && pip install .\n"
        "    QUAD_PYTHON=python3.11 make venv\n"
        "With ROS, whose modules are the system's Python's: Debian 12 or 13, or a container:\n"
        "    docker build --tag quad ."
    ) % (version[0], version[1], executable, first[0], first[1], end[0], end[1] - 1)


def main():
    """End the process with the reason if its Python cannot be used."""
    reason = refusal(sys.version_info, sys.executable)
    if reason:
        sys.exit(reason)


if __name__ == "__main__":
    main()
