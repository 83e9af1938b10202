"""Sizes of modules and functions, one source of the version, the architecture page.

ruff finds what is public and has no docstring: see the rules D in ``pyproject.toml``.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Iterator
from xml.etree import ElementTree

import pytest

import quad_nav

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "src"
PACKAGE = SOURCES / "quad_nav"
MODULES = sorted(SOURCES.rglob("*.py"))

MOST_LOOSE_MODULES = 9  # directly in quad_nav
MOST_LINES = 400
MOST_FUNCTION_LINES = 40  # signature and docstring included, kernels apart
PRINTS_ITS_OWN = ("quad_nav/config/reference.py",)  # our own documentation


def test_few_modules_are_outside_of_packages():
    assert len([path for path in PACKAGE.glob("*.py")]) <= MOST_LOOSE_MODULES


def test_modules_are_short_enough():
    assert {name(path): lines_of(path) for path in MODULES if lines_of(path) > MOST_LINES} == {}


def test_functions_are_short_enough():
    assert [
        f"{name(path)}:{function.lineno} {function.name}: {length(function)} lines"
        for path in MODULES
        for function in functions(ast.parse(path.read_text()))
        if length(function) > MOST_FUNCTION_LINES and not is_kernel(function)
    ] == []


def test_nothing_is_imported_for_annotations_alone():
    assert [name(path) for path in MODULES if "TYPE_CHECKING" in path.read_text()] == []


def test_everything_printed_is_escaped():
    """Terminals obey escape sequences, and keys, names and messages come from others."""
    assert [
        f"{name(path)}:{line}"
        for path in MODULES
        for line in unescaped_prints(path, ast.parse(path.read_text()))
    ] == []


def test_results_of_rostests_do_not_overwrite_each_other():
    names = [
        (one.get("pkg"), one.get("test-name"))
        for path in (ROOT / "test" / "ros").glob("*.test")
        for one in ElementTree.parse(path).iter("test")
    ]
    assert len(names) > 30
    assert sorted(name for name in set(names) if names.count(name) > 1) == []


def unescaped_prints(path: Path, tree: ast.Module) -> Iterator[int]:
    """Yield lines that print to the terminal without ``errors.printable``."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        function = dotted(node.func)
        if function == "print" and name(path) not in PRINTS_ITS_OWN:
            if not is_escaped(node.args[0]):
                yield node.lineno
        elif function in ("click.echo", "click.secho", "sys.stdout.write", "sys.stderr.write"):
            if len(node.args) == 1 and name(path) != "quad_nav/cli/options.py":  # 2: into a file
                yield node.lineno


def is_escaped(node: ast.AST) -> bool:
    """Return true for ``printable(...)``, and for a text that begins with it."""
    if isinstance(node, ast.BinOp):
        return is_escaped(node.left)
    if isinstance(node, ast.JoinedStr):
        return is_escaped(node.values[0])
    if isinstance(node, ast.FormattedValue):
        return is_escaped(node.value)
    return isinstance(node, ast.Call) and dotted(node.func) == "printable"


def dotted(node: ast.AST) -> str:
    """Return ``a.b`` for an attribute ``b`` of ``a``."""
    if isinstance(node, ast.Attribute):
        return f"{dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


@pytest.mark.parametrize("source", ["print(x)", "click.echo(x)", "click.echo(x, err=True)"])
def test_unescaped_prints_are_found(source):
    assert list(unescaped_prints(PACKAGE / "x.py", ast.parse(source))) == [1]


def test_version_is_the_one_of_the_ros_package():
    assert quad_nav.__version__ == ElementTree.parse(ROOT / "package.xml").findtext("version")


def test_changelog_has_the_version():
    changelog = (ROOT / "CHANGELOG.md").read_text()
    assert f"## [{quad_nav.__version__}]" in changelog


def test_paths_on_the_architecture_page_exist():
    page = (ROOT / "docs" / "architecture.md").read_text()
    table = page[page.index("| to change | open |") : page.index("## Rules of the core")]
    paths = re.findall(r"`([\w./]+(?:/|\.py|\.js|\.md|Makefile|run))`", table)
    assert len(paths) > 30
    assert [
        path for path in paths if not any((at / path).exists() for at in (PACKAGE, SOURCES, ROOT))
    ] == []


def test_every_package_is_on_the_architecture_page():
    page = (ROOT / "docs" / "architecture.md").read_text()
    table = page[page.index("| package | holds |") : page.index("## To change X")]
    packages = {path.parent.name + "/" for path in PACKAGE.glob("*/__init__.py")}
    packages |= {path.parent.name + "/" for path in SOURCES.glob("*/__init__.py")} - {"quad_nav/"}
    loose = {path.stem for path in PACKAGE.glob("*.py")} - {"__init__"}
    assert set(re.findall(r"`([a-z_]+/?)`", table[: table.index("\n\n")])) >= packages | loose


def name(path: Path) -> str:
    return path.relative_to(SOURCES).as_posix()


def lines_of(path: Path) -> int:
    return len(path.read_text().splitlines())


def length(function: ast.AST) -> int:
    return function.end_lineno - function.lineno + 1


def is_kernel(function: ast.AST) -> bool:
    """Return true for a function that numba compiles."""
    return any("njit" in ast.dump(decorator) for decorator in function.decorator_list)


def functions(tree: ast.AST) -> Iterator[ast.AST]:
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
    return (node for node in ast.walk(tree) if isinstance(node, kinds))
