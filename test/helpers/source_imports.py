"""What the modules of the project import."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import List, Set

SOURCES = Path(__file__).resolve().parents[2] / "src"


def package_of(path: Path) -> List[str]:
    """The dotted parts of the package that the module's relative imports start from."""
    return list(path.relative_to(SOURCES).parent.parts)


def imported_names(source: str, package: List[str]) -> Set[str]:
    """The dotted names that the source imports anywhere, `from a import b` as `a.b`."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            parts = [*base, *(node.module or "").split(".")] if node.module else base
            names.update(".".join([*parts, alias.name]) for alias in node.names)
    return names
