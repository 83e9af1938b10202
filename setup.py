"""The Python package for catkin and pip; the metadata is in pyproject.toml.

catkin reads the arguments of this call, so what it needs stands here and not in pyproject.toml. The
version is package.xml's.
"""

from itertools import groupby
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

ROOT = Path(__file__).parent
# What the package is asked for by name (quad_nav/files/shipped.py); catkin installs it by CMake.
SHIPPED = sorted(
    path.relative_to(ROOT)
    for folder in ("config", "goals", "scenes", "spaces")
    for path in (ROOT / folder).rglob("*.*")
    if path.is_file()
)

setup(
    name="quad-nav",
    version=ElementTree.parse(ROOT / "package.xml").findtext("version"),
    packages=find_packages("src"),
    package_dir={"": "src"},
    package_data={"quad_nav.report": ["*.jinja"], "quad_nav.tuning.report": ["*.jinja"]},
    data_files=[
        (f"share/quad/{folder}", list(map(str, paths)))
        for folder, paths in groupby(SHIPPED, lambda path: path.parent)
    ],
)
