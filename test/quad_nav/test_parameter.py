"""Parameters are declared once: what derives from the declarations, and the reference page."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path

import pytest

from quad_nav import parameter
from quad_nav.config.configuration import MOVE_BASE_TABLE
from quad_nav.config.costmaps import COSTMAP_TABLE
from quad_nav.config.fixes import GROUPS
from quad_nav.config.layers import LAYERS, SOURCE_TABLE
from quad_nav.config.planners import GLOBAL_PLANNERS, LOCAL_PLANNERS
from quad_nav.config.reader import Table, made
from quad_nav.config.recoveries import TABLES as RECOVERIES
from quad_nav.config.reference import reference
from quad_nav.parameter import (
    as_upstream,
    deviation,
    fixed_number,
    flag,
    number,
    parameters_of,
    text,
    whole,
)

PAGE = Path(__file__).resolve().parents[2] / "docs" / "parameters.md"
TABLES = {
    "move_base": MOVE_BASE_TABLE,
    "costmap": COSTMAP_TABLE,
    "source": SOURCE_TABLE,
    **GROUPS,
    **LAYERS,
    **RECOVERIES,
    **GLOBAL_PLANNERS,
    **LOCAL_PLANNERS,
}


@dataclass(frozen=True)
class Part:
    """A part of the next one, with a deviation from upstream."""

    patience_s: float = number("patience", 3.0, "seconds", 0, 9, "How long.", upstream=0.0)


@dataclass(frozen=True)
class Base:
    """Parameters of a base."""

    last: int = whole("last", 1, "", 0, 5, "The last one.")
    first: bool = flag("first", True, "The first one.")


@dataclass(frozen=True)
class Params(Base):
    """Parameters of every kind."""

    ours: float = number("ours", 1.0, "m", 0, 5, "Not upstream's.", own=True)
    last: int = whole("last", 2, "", 0, 5, "The last one.")
    late_s: float = number("late", 5.0, "seconds", 0, 9, "Later.", initial=15.0)
    count: float = text("count", "7", "a number", "Converted.", convert=float)
    once: float = fixed_number("once", 0.5, "m", "Read at the start.")
    escapes: bool = deviation()
    part: Part = Part()


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_defaults_are_valid(table):
    for one in table.parameters:
        for value in (one.default, one.in_force):
            if value is not None:
                assert one.clamp(one.check(value)) == value, one.name


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_names_are_unique_and_described(table):
    names = [one.name for one in table.parameters]
    names += [*table.unsupported, *table.ignored]
    assert len(names) == len(set(names))
    assert [one.name for one in table.parameters if not one.description.endswith(".")] in (
        [],
        ["combination_method"],  # as the original has it
    )


def test_fields_have_the_declared_defaults():
    params = Params()
    assert (params.first, params.last, params.ours, params.once) == (True, 2, 1.0, 0.5)
    assert (params.late_s, params.count) == (15.0, 7.0)


def test_what_is_declared_again_stands_where_the_subclass_has_it():
    names = [one.name for one in parameters_of(Params)]
    assert names == ["first", "ours", "last", "late", "count", "once"]


def test_own_parameters_come_after_those_of_upstream():
    table = Table((Params,), restores=True)
    names = [one.name for one in table.reconfigurable]
    assert names == ["first", "last", "late", "count", "restore_defaults", "ours"]
    assert [one.name for one in table.fixed] == ["once"]


def test_a_dataclass_is_made_of_its_namespace():
    assert made(Params, {}) == Params()
    namespace = {"late": 4.0, "count": "8", "last": 3, "unknown": 1}
    assert made(Params, namespace, once=2.0) == Params(count=8.0, last=3, once=2.0)
    assert made(Params, namespace, given=["late"]).late_s == 4.0


def test_upstream_is_without_deviations_in_every_part():
    params = as_upstream(Params(ours=2.0))
    assert params == Params(ours=2.0, escapes=False, part=Part(0.0))


def test_a_declaration_takes_three_lines_at_most():
    kinds = {name for name, value in vars(parameter).items() if not name.startswith("_")}
    long = []
    for path in Path(parameter.__file__).parents[1].rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            call = node.value if isinstance(node, ast.AnnAssign) else None
            if isinstance(call, ast.Call) and getattr(call.func, "id", "") in kinds:
                lines = (node.end_lineno or 0) - node.lineno + 1
                long += [f"{path.name}:{node.lineno}"] if lines > 3 else []
    assert long == []


def test_reference_page_is_up_to_date():
    command = "python -m quad_nav.config.reference > docs/parameters.md"
    assert PAGE.read_text() == reference(), command
