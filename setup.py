"""The Python package for catkin and pip; the metadata is in pyproject.toml.

catkin reads the arguments of this call, so what it needs stands here and not in pyproject.toml. The
version is package.xml's.
"""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

setup(
    name="quad-nav",
    version=ElementTree.parse(Path(__file__).with_name("package.xml")).findtext("version"),
    packages=find_packages("src"),
    package_dir={"": "src"},
)
