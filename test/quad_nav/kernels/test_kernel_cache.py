"""Folders of compiled kernels; damaged, foreign and full caches."""

from __future__ import annotations

import errno
import os
import pickle
import stat
from pathlib import Path

import pytest
from numba.core import caching

from quad_nav.cli.options import show_warnings
from quad_nav.files import cache_folder
from quad_nav.files.cache_folder import user_cache_folder
from quad_nav.kernels import jit, library
from quad_nav.kernels.numba_cache import compile_with_numba


def doubled(x):
    return 2 * x


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    monkeypatch.setattr(library, "FOLDER", tmp_path)
    return tmp_path


def kernel():
    return compile_with_numba(doubled, True, {"nogil": True})


def cached() -> bool:
    """Call the kernel; true if its result came from the cache."""
    one = kernel()
    assert one(21) == 42
    return sum(one.stats.cache_hits.values()) == 1


def test_kernels_are_cached(cache):
    assert [cached(), cached()] == [False, True]


def test_kernels_are_compiled_anew_when_any_kernel_changes(cache, monkeypatch):
    """numba's own stamp covers the module of the kernel, not those that the kernel calls."""
    assert not cached()
    monkeypatch.setattr(library, "DIGEST", "another")
    assert [cached(), cached()] == [False, True]


def test_digest_covers_every_kernel(tmp_path, monkeypatch):
    sources = tmp_path / "kernels"
    sources.mkdir()
    (sources.parent / "grid.py").write_text("FREE = 0")
    for name in ("a.py", "b.py"):
        (sources / name).write_text("")
    monkeypatch.setattr(library, "SOURCES", sources)
    digests = {library.find_digest()}
    for path in (sources / "a.py", sources / "b.py", sources.parent / "grid.py"):
        path.write_text("CHANGED = 1")
        digests.add(library.find_digest())
    assert len(digests) == 4


class Gone:
    """A type of an earlier version."""


@pytest.mark.parametrize("damage", ["garbage", "missing type", "truncated", "data"])
def test_damaged_cache_is_replaced(cache, damage):
    assert not cached()
    (index,), (data,) = cache.glob("*.nbi"), cache.glob("*.nbc")
    version = pickle.dumps(caching.numba.__version__)
    if damage == "garbage":
        index.write_bytes(b"\x00garbage")
    elif damage == "missing type":
        entry = pickle.dumps(("stamp", {Gone: "x"}))
        index.write_bytes(version + entry.replace(b"Gone", b"G0ne"))
    elif damage == "truncated":
        index.write_bytes(index.read_bytes()[:-9])
    else:
        data.write_bytes(b"")
    assert [cached(), cached()] == [False, True]


def test_full_disk_does_not_end_a_flight(cache, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as context:
        context.setattr(caching.IndexDataCacheFile, "_open_for_write", full)
        assert not cached()
        for index in cache.glob("doubled*.nbi"):
            index.write_bytes(b"")
        assert not cached()
    assert [cached(), cached()] == [False, True]


def test_without_a_folder_kernels_run_and_the_cost_is_told(monkeypatch, capsys):
    monkeypatch.setattr(library, "FOLDER", None)
    monkeypatch.setattr(jit, "_LIBRARY", None)
    monkeypatch.setattr(
        library, "PROBLEMS", ["/a: Permission denied", "/b: is open to other users"]
    )
    assert [cached(), cached()] == [False, False]
    show_warnings(["robot0: odd"])
    first, second = capsys.readouterr().err.splitlines()
    assert first == "robot0: odd"
    assert "/a: Permission denied; /b: is open" in second and "takes about 30 s" in second


def test_nothing_is_told_with_a_cache(cache):
    assert jit.cache_warnings() == []


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


def test_sources_come_first(tmp_path, monkeypatch):
    monkeypatch.setattr(library, "SOURCES", tmp_path)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    assert library.find_cache_folder() == (tmp_path / "__pycache__", [])


def test_folder_of_numba_is_used(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "given"))
    assert library.find_cache_folder() == (tmp_path / "given", [])


def test_read_only_sources_and_no_home_use_the_temporary_folder(places, monkeypatch):
    (places / "sources").write_text("a file: no folder can be made in it, even by root")
    monkeypatch.setattr(library, "SOURCES", places / "sources")
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    folder, problems = library.find_cache_folder()
    assert folder.parent == temporary(places)
    assert stat.S_IMODE(folder.parent.stat().st_mode) == 0o700
    assert len(problems) == 2 and "Not a directory" in problems[0]
    assert not (places / "nonexistent").exists()


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


@pytest.mark.parametrize("mode", [0o770, 0o707, 0o755, 0o711])
def test_folder_that_is_open_to_others_is_refused(places, mode):
    temporary(places).mkdir()
    temporary(places).chmod(mode)
    folder, problems = user_cache_folder("x")
    assert folder is None and "is open to other users" in problems[-1]


def test_link_is_refused(places):
    (places / "elsewhere").mkdir(mode=0o700)
    temporary(places).symlink_to(places / "elsewhere")
    folder, problems = user_cache_folder("x")
    assert folder is None and "is no folder" in problems[-1]


def test_folder_that_others_can_replace_is_refused(places):
    (places / "tmp").chmod(0o777)  # no sticky bit: whoever writes there can rename
    folder, problems = user_cache_folder("x")
    assert folder is None and "other users can replace it" in problems[-1]


def test_without_any_place_there_is_none(places, monkeypatch):
    (places / "tmp").rmdir()
    (places / "tmp").write_text("")
    folder, problems = user_cache_folder("x")
    assert folder is None and len(problems) == 2
