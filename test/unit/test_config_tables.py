"""The tables agree with the dataclasses that they fill, and the reference page with them."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pytest

from quad_nav.config import costmap_tables, global_planner_tables, tables
from quad_nav.config.fixes import FIXES_TABLE, switches_of
from quad_nav.config.reference import reference
from quad_nav.config.spec import Table
from quad_nav.control.dwa_planner import DwaParams
from quad_nav.control.trajectory_planner import TrajectoryPlannerParams
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.layered import CostmapParams
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.scan_validator import ScanValidatorParams
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.costmap.voxel import VoxelLayerParams
from quad_nav.navigator.navigator import NavigatorParams
from quad_nav.navigator.progress_checker import ProgressParams
from quad_nav.peers.params import PeerParams
from quad_nav.plan.carrot import CarrotParams
from quad_nav.plan.global_planner import SearchPlannerParams
from quad_nav.plan.navfn import NavfnParams
from quad_nav.recovery import ClearCostmapParams, MoveSlowAndClearParams, RotateParams

PAGE = Path(__file__).resolve().parents[2] / "docs" / "parameters.md"

ROTATE = Table(fixed=tables.ROTATE.fixed + tables.ROTATE_FROM_PLANNER)
# (dataclass, table, fields that are read in another way than from one row)
PAIRS = [
    (NavigatorParams, tables.NAVIGATOR, {"recovery_behaviors", "progress"}),
    (TrajectoryPlannerParams, tables.TRAJECTORY_PLANNER, set()),
    (NavfnParams, tables.NAVFN, set()),
    (SearchPlannerParams, global_planner_tables.SEARCH_PLANNER, set()),
    (CarrotParams, global_planner_tables.CARROT, set()),
    (ClearCostmapParams, tables.CLEAR_COSTMAP, {"layer_names"}),
    (RotateParams, ROTATE, set()),
    (MoveSlowAndClearParams, tables.MOVE_SLOW, {"translation_fields", "rotation_fields"}),
    (CostmapParams, costmap_tables.COSTMAP, {"layers"}),
    (ObstacleLayerParams, costmap_tables.OBSTACLE_LAYER, {"sources", "track_unknown_space"}),
    (VoxelLayerParams, costmap_tables.VOXEL_LAYER, {"sources", "track_unknown_space"}),
    (SourceParams, costmap_tables.SOURCE, {"name", "obstacle_range_m", "raytrace_range_m"}),
    (InflationLayerParams, costmap_tables.INFLATION_LAYER, set()),
    (StaticLayerParams, costmap_tables.STATIC_LAYER, set()),
]
TABLES = [*(table for _, table, _ in PAIRS), FIXES_TABLE]
SWITCH_OWNERS = [
    ClearCostmapParams,
    DwaParams,
    NavigatorParams,
    PeerParams,
    ProgressParams,
    RotateParams,
    ScanValidatorParams,
    TrajectoryPlannerParams,
]


@pytest.mark.parametrize(
    "params, table, apart", PAIRS, ids=lambda value: getattr(value, "__name__", "")
)
def test_every_field_has_a_spelling_and_the_same_default(params, table, apart):
    of_table = {
        parameter.field: parameter.field_value(parameter.in_force)
        for parameter in table.parameters
        if parameter.field
    }
    switches = {parameter.field for parameter in switches_of(params)}
    of_class = {field.name: field.default for field in fields(params) if field.name not in switches}
    assert set(of_class) == set(of_table) | apart
    shared = set(of_table) - apart
    assert {name: of_table[name] for name in shared} == {name: of_class[name] for name in shared}


def test_every_switch_has_an_owner_with_the_same_default():
    owned = set()
    for owner in SWITCH_OWNERS:
        of_class = {field.name: field.default for field in fields(owner)}
        for switch in switches_of(owner):
            assert of_class[switch.field] == switch.default, switch.name
            owned.add(switch.name)
    assert owned == {parameter.name for parameter in FIXES_TABLE.parameters} - {"restore_defaults"}


@pytest.mark.parametrize("table", TABLES)
def test_defaults_are_values_that_may_be_written(table):
    for parameter in table.parameters:
        for value in (parameter.default, parameter.in_force):
            assert parameter.clamp(parameter.check(value)) == value, parameter.name


@pytest.mark.parametrize("table", TABLES)
def test_names_are_unique(table):
    names = [parameter.name for parameter in table.parameters]
    names += [name for name, _ in table.unsupported + table.ignored]
    assert len(names) == len(set(names))


def test_reference_page_is_up_to_date():
    command = "python -m quad_nav.config.reference > docs/parameters.md"
    assert PAGE.read_text() == reference(), command
