"""The picture of the packages is the one that the script draws from the imports."""

from __future__ import annotations

import importlib.machinery
import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LOADER = importlib.machinery.SourceFileLoader("draw_packages", str(ROOT / "scripts/draw_packages"))
DRAW = importlib.util.module_from_spec(importlib.util.spec_from_loader("draw_packages", LOADER))
LOADER.exec_module(DRAW)


def write(folder: Path, **modules: str) -> None:
    for name, text in modules.items():
        path = folder.joinpath(*name.split("__")).with_suffix(".py")
        path.parent.mkdir(parents=True, exist_ok=True)
        (path.parent / "__init__.py").touch()
        path.write_text(text)


def test_the_picture_shows_the_imports_of_today():
    drawn = (ROOT / "docs/images/architecture.svg").read_text(encoding="utf-8")
    assert drawn == DRAW.picture(ROOT / "src"), "run scripts/draw_packages"


def test_imports_that_follow_from_others_are_left_out(tmp_path):
    write(
        tmp_path,
        quad_nav__grid="",
        quad_nav__plan__wave="from quad_nav import grid",
        quad_nav__navigator__tick="from ..plan import wave\nimport quad_nav.grid",
        quad_web__page="def show():\n    from quad_nav.navigator.tick import Tick",
    )
    imports = DRAW.package_imports(tmp_path)
    assert imports["navigator/"] == {"plan/", DRAW.GROUND}
    assert DRAW.without_detours(imports) == {
        DRAW.GROUND: set(),
        "plan/": {DRAW.GROUND},
        "navigator/": {"plan/"},
        "quad_web": {"navigator/"},
    }


def test_a_circle_is_named(tmp_path):
    write(tmp_path, quad_nav__a__x="import quad_nav.b.y", quad_nav__b__y="import quad_nav.a.x")
    with pytest.raises(SystemExit, match="a/ -> b/ -> a/"):
        DRAW.without_detours(DRAW.package_imports(tmp_path))
