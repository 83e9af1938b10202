"""Folders of compiled kernels, and when they are compiled anew."""

from __future__ import annotations

import importlib.util
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from source_imports import imported_names, package_of

from quad_nav.cli.options import show_warnings
from quad_nav.files import cache_folder, kernel_cache
from quad_nav.files.cache_folder import user_cache_folder

CALLER = """
from quad_nav.files.kernel_cache import njit
from quad_nav.callee import FACTOR, increased


@njit(cache=True, nogil=True)
def kernel(x):
    return increased(FACTOR * x)
"""
CALLEE = """
from quad_nav.files.kernel_cache import njit

FACTOR = {factor}


@njit(cache=True, nogil=True)
def increased(x):
    return x + {more}
"""


@pytest.fixture
def package(tmp_path, monkeypatch) -> Path:
    """Sources in a folder of their own: a kernel that calls one of another module."""
    sources = tmp_path / "src" / "quad_nav"
    sources.mkdir(parents=True)
    (sources / "caller.py").write_text(CALLER)
    (sources / "callee.py").write_text(CALLEE.format(factor=2, more=1))
    # Byte code of a source that changes within a second, and not in size, would be used again.
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.setattr(kernel_cache, "SOURCES", tmp_path / "src")
    monkeypatch.setattr(kernel_cache, "FOLDER", tmp_path / "cache")
    return sources


@pytest.fixture(autouse=True)
def new_process():
    """Forget the sources of earlier tests."""
    kernel_cache._content.cache_clear()
    kernel_cache._imported.cache_clear()
    yield
    kernel_cache._content.cache_clear()
    kernel_cache._imported.cache_clear()


def load(path: Path, monkeypatch):
    name = f"quad_nav.{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    spec.loader.exec_module(module)
    return module


def call(package: Path, monkeypatch):
    """Load both modules; return what the kernel returns for 20, and whether it was cached."""
    kernel_cache._content.cache_clear()
    kernel_cache._imported.cache_clear()
    load(package / "callee.py", monkeypatch)
    kernel = load(package / "caller.py", monkeypatch).kernel
    return kernel(20), sum(kernel.stats.cache_hits.values()) == 1


@pytest.mark.parametrize("factor, more, result", [(2, 5, 45), (3, 1, 61)])
def test_a_kernel_is_compiled_anew_when_another_module_changes(
    package, monkeypatch, factor, more, result
):
    """The kernel that it calls, and a constant that it reads, are in its machine code."""
    call(package, monkeypatch)
    (package / "callee.py").write_text(CALLEE.format(factor=factor, more=more))
    assert call(package, monkeypatch) == (result, False)
    assert call(package, monkeypatch) == (result, True)


def test_a_kernel_stays_cached_when_a_module_changes_that_it_does_not_import(package, monkeypatch):
    call(package, monkeypatch)
    (package / "other.py").write_text("")
    callee = kernel_cache.folder_name(package / "callee.py")
    (package / "caller.py").write_text(CALLER + "# changed")
    assert call(package, monkeypatch) == (41, False)
    assert kernel_cache.folder_name(package / "callee.py") == callee


def test_a_link_to_the_sources_has_the_same_cache(package, monkeypatch):
    """As catkin's development space has."""
    (package.parents[1] / "link").symlink_to(package)
    assert call(package, monkeypatch) == (41, False)
    assert call(package.parents[1] / "link", monkeypatch) == (41, True)


def test_a_kernel_runs_as_python():
    """With NUMBA_DISABLE_JIT."""
    code = "from quad_nav.costmap.cost_grid_kernel import cell_of; print(type(cell_of))"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "NUMBA_DISABLE_JIT": "1"}
    run = subprocess.run([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE)
    assert run.stdout.split() == [b"<class", b"'function'>"]


def test_without_a_folder_kernels_run_and_the_cost_is_told(package, monkeypatch, capsys):
    monkeypatch.setattr(kernel_cache, "FOLDER", None)
    monkeypatch.setattr(
        kernel_cache, "PROBLEMS", ["/a: Permission denied", "/b: is open to other users"]
    )
    assert [call(package, monkeypatch), call(package, monkeypatch)] == [(41, False), (41, False)]
    show_warnings(["robot0: odd"])
    first, second = capsys.readouterr().err.splitlines()
    assert first == "robot0: odd"
    assert "/a: Permission denied; /b: is open" in second and "takes about 60 s" in second


def modules_with_kernels():
    return [
        path for path in kernel_cache.SOURCES.rglob("*.py") if "import njit" in path.read_text()
    ]


@pytest.mark.parametrize("path", modules_with_kernels(), ids=lambda path: path.stem)
def test_sources_of_a_kernel_are_all_modules_of_ours_that_it_imports(path):
    names = imported_names(path.read_text(), package_of(path))
    files = [kernel_cache.SOURCES.joinpath(*name.split(".")) for name in names]
    imported = {
        file
        for at in files
        for file in (at.with_suffix(".py"), at.parent.with_suffix(".py"))
        if file.is_file() and file != Path(kernel_cache.__file__)
    }
    assert imported <= kernel_cache.sources_of(path)


@pytest.fixture
def places(tmp_path, monkeypatch) -> Path:
    """Nothing but ``tmp_path``: HOME does not exist, as a service user's."""
    monkeypatch.setenv("HOME", str(tmp_path / "nonexistent" / "home"))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(cache_folder.tempfile, "tempdir", str(tmp_path / "tmp"))
    (tmp_path / "tmp").mkdir()
    (tmp_path / "tmp").chmod(0o1777)
    return tmp_path


def temporary(places) -> Path:
    return places / "tmp" / f"quad-nav-{os.geteuid()}"


def test_folder_of_numba_comes_first_and_then_the_sources(tmp_path, monkeypatch):
    monkeypatch.setattr(kernel_cache, "_PACKAGE", tmp_path)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "given"))
    assert kernel_cache.find_cache_folder() == (tmp_path / "given", [])
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    assert kernel_cache.find_cache_folder() == (tmp_path / "__pycache__" / "kernels", [])


def test_read_only_sources_and_no_home_use_the_temporary_folder(places, monkeypatch):
    (places / "sources").write_text("a file: no folder can be made in it, even by root")
    monkeypatch.setattr(kernel_cache, "_PACKAGE", places / "sources")
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    folder, problems = kernel_cache.find_cache_folder()
    assert folder.parent == temporary(places)
    assert stat.S_IMODE(folder.parent.stat().st_mode) == 0o700
    assert len(problems) == 2 and "Not a directory" in problems[0]
    assert not (places / "nonexistent").exists()


def test_kernels_beside_sources_of_another_user_are_copied(places, monkeypatch):
    kernels = places / "sources" / "__pycache__" / "kernels"
    for name in ("old", "new"):
        (kernels / name / "of_quad_nav").mkdir(parents=True)
        (kernels / name / "of_quad_nav" / "kernel.nbi").write_text(name)
    monkeypatch.setattr(kernel_cache, "_PACKAGE", places / "sources")
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)

    def require(folder):
        if folder == kernels:
            raise OSError(13, "Permission denied")

    monkeypatch.setattr(kernel_cache, "require_writable", require)
    own, _ = kernel_cache.find_cache_folder()
    assert own.parent == temporary(places)
    assert (own / "new" / "of_quad_nav" / "kernel.nbi").read_text() == "new"
    (own / "old" / "of_quad_nav" / "kernel.nbi").write_text("compiled here")
    assert kernel_cache.find_cache_folder()[0] == own
    assert (own / "old" / "of_quad_nav" / "kernel.nbi").read_text() == "compiled here"
    assert sorted(path.name for path in own.iterdir()) == ["new", "old"]


def test_home_and_xdg_come_before_the_temporary_folder(places, monkeypatch):
    (places / "home").mkdir()
    monkeypatch.setenv("HOME", str(places / "home"))
    assert user_cache_folder("x")[0] == places / "home" / ".cache" / "quad-nav" / "x"
    monkeypatch.setenv("XDG_CACHE_HOME", str(places / "xdg"))
    assert user_cache_folder("x")[0] == places / "xdg" / "quad-nav" / "x"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert user_cache_folder("x")[0] == places / "home" / ".cache" / "quad-nav" / "x"


def test_folder_of_another_user_is_refused(places, monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: 4242)
    temporary(places).mkdir(mode=0o700)
    folder, problems = user_cache_folder("x")
    assert folder is None
    assert f"belongs to user {os.getuid()}, not to this user" in problems[-1]


@pytest.mark.parametrize("mode", [0o770, 0o707, 0o711])
def test_folder_that_is_open_to_others_is_refused(places, mode):
    temporary(places).mkdir()
    temporary(places).chmod(mode)
    folder, problems = user_cache_folder("x")
    assert folder is None and "is open to other users" in problems[-1]


def test_link_and_folder_that_others_can_replace_are_refused(places):
    (places / "elsewhere").mkdir(mode=0o700)
    temporary(places).symlink_to(places / "elsewhere")
    folder, problems = user_cache_folder("x")
    assert folder is None and "is no folder" in problems[-1]
    temporary(places).unlink()
    (places / "tmp").chmod(0o777)  # no sticky bit: whoever writes there can rename
    folder, problems = user_cache_folder("x")
    assert folder is None and "other users can replace it" in problems[-1]


def test_without_any_place_there_is_none(places, monkeypatch):
    (places / "tmp").rmdir()
    (places / "tmp").write_text("")
    folder, problems = user_cache_folder("x")
    assert folder is None and len(problems) == 2
