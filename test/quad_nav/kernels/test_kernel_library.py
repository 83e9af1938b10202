"""Kernels of the library: which calls are its own, what they return, and what replaces it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple, Tuple

import numba
import numpy as np
import pytest

from quad_nav.kernels import jit, library
from quad_nav.kernels.build_library import BuildError, build

ROOT = Path(__file__).resolve().parents[3]
SOURCES = ROOT / "src"


class Inner(NamedTuple):
    """A record in a record."""

    cells: np.ndarray
    scale: float


class Outer(NamedTuple):
    """A record."""

    inner: Inner
    is_doubled: bool


class Other(NamedTuple):
    """A record with the fields of ``Outer``."""

    inner: Inner
    is_doubled: bool


def weigh(outer: Outer, at: Tuple[int, int], factor: float = 1.0) -> float:
    """Scale one cell."""
    value = outer.inner.cells[at[0], at[1]] * outer.inner.scale * factor
    return 2.0 * value if outer.is_doubled else value


def results(values, number, small, flag):
    """Return one of each kind of value."""
    copied = values[1:] + number
    return copied, (number, small, not flag, len(values)), np.float32(0.1)


def record(values, flag):
    """Return a record that holds an argument."""
    return Outer(Inner(values, 0.5), flag)


def tail(values):
    """Return a view of an argument."""
    return values[1:]


def fill(values, number):
    """Write, and return nothing."""
    values[:] = number


def quotient(a, b):
    """Divide integers, which numba checks."""
    return a // b


VALUES = np.arange(3.0)
CELLS = np.arange(6, dtype=np.uint8).reshape(2, 3)
OUTER = Outer(Inner(CELLS, 0.5), True)
CALLS = [
    (weigh, (OUTER, (1, 2), 3.0)),
    (weigh, (OUTER, (1, 2))),
    (results, (VALUES, 2, np.float32(0.3), True)),
    (record, (CELLS, False)),
    (tail, (VALUES,)),
    (fill, (VALUES.copy(), 7.0)),
    (fill, (CELLS[:, ::2].copy(), 7)),
    (quotient, (7, 2)),
]


@pytest.fixture(scope="module")
def loaded(tmp_path_factory):
    """The library of the functions above, for the types in ``CALLS``."""
    kernels = {}
    for function, arguments in CALLS:
        kernels.setdefault(function, numba.njit(nogil=True)(function))(*arguments)
    path = tmp_path_factory.mktemp("library") / "quad_kernels.so"
    assert build(kernels.values(), path) == len(CALLS)
    module, reason = library._load(path)
    assert module is not None, reason
    return module


@pytest.fixture
def kernel(loaded):
    """Return the library's kernel of a function, which fails with other types."""

    def of(function, otherwise=None):
        def fails(*arguments):
            raise LookupError(arguments)

        return loaded.kernel(f"{__name__}.{function.__qualname__}", otherwise or fails)

    return of


def test_results_are_those_of_python(kernel):
    assert kernel(weigh)(OUTER, (1, 2), 3.0) == 15.0
    assert kernel(weigh)(OUTER, (1, 2)) == 5.0
    assert kernel(quotient)(-7, 2) == -4
    copied, scalars, number = kernel(results)(VALUES, 2, np.float32(0.3), True)
    assert copied.tolist() == [3.0, 4.0] and copied.dtype == np.float64 and copied.flags.writeable
    assert scalars == (2, float(np.float32(0.3)), False, 3)
    assert [type(one) for one in scalars] == [int, float, bool, int]
    assert number == float(np.float32(0.1))


def test_records_and_their_arrays_come_back(kernel):
    made = kernel(record)(CELLS, False)
    assert type(made) is Outer and type(made.inner) is Inner
    assert made.inner.cells is CELLS and made.inner.scale == 0.5 and made.is_doubled is False


def test_kernel_writes_into_the_callers_array(kernel):
    values = np.zeros(4)
    assert kernel(fill)(values, 7.0) is None
    assert values.tolist() == [7.0] * 4


def test_views_keep_their_memory_and_nothing_leaks(kernel):
    values = np.arange(3.0)
    before = sys.getrefcount(values)
    view = kernel(tail)(values)
    assert view.tolist() == [1.0, 2.0] and np.shares_memory(view, values)
    assert sys.getrefcount(values) == before + 1
    del view
    for _ in range(10):
        kernel(tail)(values)
        kernel(results)(values, 2, np.float32(0.3), True)
    assert sys.getrefcount(values) == before


def test_numpys_scalars_are_numbers(kernel):
    assert kernel(weigh)(OUTER, (np.int64(1), 2), np.float64(3.0)) == 15.0
    assert kernel(weigh)(OUTER._replace(is_doubled=np.bool_(False)), (1, 2), 1.0) == 2.5


@pytest.mark.parametrize(
    "function, arguments",
    [
        (weigh, (OUTER, (1, 2), 3)),  # an int is no float64: numba compiles for it
        (weigh, (OUTER, (1, 2.0), 3.0)),
        (weigh, (OUTER, (1, 2, 3), 3.0)),
        (weigh, (OUTER, [1, 2], 3.0)),
        (weigh, (Other(*OUTER), (1, 2), 3.0)),
        (weigh, (tuple(OUTER), (1, 2), 3.0)),
        (weigh, (OUTER, (1, 2), 3.0, 4.0)),
        (weigh, (OUTER._replace(inner=Inner(CELLS.astype(np.int8), 0.5)), (1, 2), 3.0)),
        (fill, (np.zeros(3, np.float32), 7.0)),
        (fill, (np.zeros((2, 3, 1), np.uint8), 7)),
        (fill, (np.zeros((2, 3), np.uint8, order="F"), 7)),
        (fill, (np.zeros(6)[::2], 7.0)),
        (fill, (np.zeros(3, ">f8"), 7.0)),
        (fill, (np.frombuffer(bytes(24)), 7.0)),  # read-only
        (fill, (np.frombuffer(bytearray(25), offset=1), 7.0)),  # not aligned
        (fill, (np.zeros(3), None)),
        (quotient, (2**63, 2)),
        (quotient, (True, 2)),
    ],
)
def test_other_types_are_left_to_numba(kernel, function, arguments):
    with pytest.raises(LookupError) as caught:
        kernel(function)(*arguments)
    assert caught.value.args[0] is not None and len(caught.value.args[0]) == len(arguments)


def test_keywords_are_left_to_numba(kernel):
    assert kernel(quotient, lambda a, b: (a, b))(a=7, b=2) == (7, 2)


def test_exceptions_are_those_of_the_kernel(kernel):
    with pytest.raises(ZeroDivisionError):
        kernel(quotient)(7, 0)


def test_kernel_that_is_not_in_the_library_is_numbas(loaded):
    assert loaded.kernel("nowhere.at_all", weigh) is weigh


def test_numba_compiles_kernels_that_call_a_kernel_of_the_library(loaded, monkeypatch):
    monkeypatch.setattr(jit, "_LIBRARY", loaded)
    monkeypatch.setattr(jit, "_IS_DISABLED", False)
    monkeypatch.setattr(jit, "_missing", [])
    divide = jit.njit(nogil=True)(quotient)
    assert divide(7, 2) == 3 and jit.library_remarks() == []

    @jit.njit(nogil=True)
    def twice(a, b):
        return 2 * divide(a, b)

    assert twice(7, 2) == 6
    assert divide(7.0, 2.0) == 3.0
    (remark,) = jit.library_remarks()
    assert "twice, quotient" in remark


def test_damaged_library_is_replaced_by_numba(tmp_path):
    path = tmp_path / "quad_kernels.so"
    path.write_bytes(b"\x7fELF")
    module, reason = library._load(path)
    assert module is None and "too short" in reason


def test_library_of_another_processor_is_not_used(loaded, monkeypatch, tmp_path):
    flags = set(loaded.cpu_flags.split())
    assert flags == set(library.cpu_flags())
    info = tmp_path / "cpuinfo"
    info.write_text(f"processor : 0\nflags : {' '.join(flags - {'avx2', 'asimd'})}\n")
    monkeypatch.setattr(library, "_CPU_INFO", info)
    module, reason = library._load(Path(loaded.__file__))
    assert module is None and reason.endswith(("lacks avx2", "lacks asimd"))


def test_without_a_compiler_nothing_is_built(monkeypatch, tmp_path):
    monkeypatch.setenv("CC", str(tmp_path / "none"))
    compiled = numba.njit(quotient)
    compiled(7, 2)
    with pytest.raises(BuildError, match="none: No such file"):
        build([compiled], tmp_path / "library.so")
    assert not (tmp_path / "library.so").exists()


@pytest.mark.parametrize("variable, value", [("QUAD_KERNELS", "numba"), ("NUMBA_BOUNDSCHECK", "1")])
def test_environment_chooses_numba(monkeypatch, variable, value):
    for name in [name for name in os.environ if name.startswith("NUMBA_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv(variable, value)
    module, reason = library.load_library()
    assert module is None and reason.startswith(variable)


WARM_UP = "from quad_nav.scenario.warm_up import fly_missions; fly_missions()"
AMONG_PEOPLE = f"""
from pathlib import Path
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
scene = Path("{ROOT}/scenes/examples/walkers.yaml")
goals = Path("{ROOT}/goals/examples/walkers")
fly(read_setup(FlightOptions(scene, goals, "people", time_limit_s=15.0)), ())
"""


@pytest.mark.parametrize("flight", [WARM_UP, AMONG_PEOPLE], ids=["warm-up", "among people"])
def test_flight_needs_no_numba_with_the_library(flight):
    """The library of this checkout, where it is built: `make workspace` and catkin build it.

    numba would compile in flight, and the robot would fly on with its last command for seconds.
    """
    code = (
        "import sys; from quad_nav.kernels import jit\n"
        f"print(jit._LIBRARY is not None)\n{flight}\n"
        "print(*jit.library_remarks()); print('numba' in sys.modules)"
    )
    environment = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")}
    environment["PYTHONPATH"] = str(SOURCES)
    output = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    if output[0] == "False":
        pytest.skip("the library is not built for these sources")
    assert output[1:] == ["", "False"]
