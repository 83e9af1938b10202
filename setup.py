"""Build the Python package for catkin and for pip.

catkin executes this file and reads the arguments of ``setup``, so everything that catkin needs is
here; the rest of the metadata is in ``pyproject.toml``. The version is the one of ``package.xml``.
"""

import runpy
from itertools import groupby
from pathlib import Path
from xml.etree import ElementTree

import setuptools

ROOT = Path(__file__).parent
# Sooner than pip compares requires-python, and with the way out.
runpy.run_path(str(ROOT / "scripts" / "check_python.py"), run_name="__main__")
# Files that `quad_nav.files.shipped` finds by name. CMakeLists.txt installs them for catkin.
SHIPPED = sorted(
    path.relative_to(ROOT)
    for folder in ("config", "goals", "localization", "msg", "scenes", "spaces")
    for path in (ROOT / folder).rglob("*.*")
    if path.is_file()
)
# setuptools 77 is the first with SPDX expressions. Noetic has 45, Debian 12 has 66.
LICENSE = "license_expression" if int(setuptools.__version__.split(".")[0]) >= 77 else "license"

setuptools.setup(
    name="quad-nav",
    version=ElementTree.parse(ROOT / "package.xml").findtext("version"),
    packages=setuptools.find_packages("src"),
    package_dir={"": "src"},
    package_data={
        "": ["py.typed"],
        "quad_nav": ["*.pyi"],
        "quad_nav.config": ["*.pyi"],
        "quad_nav.report": ["*.css", "*.jinja"],
        "quad_tune.report": ["*.jinja"],
        "quad_web": ["static/*"],
    },
    data_files=[
        (f"share/quad/{folder}", list(map(str, paths)))
        for folder, paths in groupby(SHIPPED, lambda path: path.parent)
    ],
    **{LICENSE: "BSD-3-Clause"},
)
