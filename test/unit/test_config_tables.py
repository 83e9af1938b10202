"""The tables agree with the dataclasses that they fill, and the reference page with them."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pytest

from quad_nav.config.fixes import FIXES_TABLE, switches_of
from quad_nav.config.reference import reference
from quad_nav.config.spec import Table
from quad_nav.config.tables.costmap import COSTMAP_TABLE
from quad_nav.config.tables.global_planners import CARROT_TABLE, GLOBAL_PLANNER_TABLE, NAVFN_TABLE
from quad_nav.config.tables.layers import (
    INFLATION_LAYER_TABLE,
    OBSTACLE_LAYER_TABLE,
    SOURCE_TABLE,
    STATIC_LAYER_TABLE,
    VOXEL_LAYER_TABLE,
)
from quad_nav.config.tables.move_base import MOVE_BASE_TABLE
from quad_nav.config.tables.recoveries import (
    CLEAR_COSTMAP_TABLE,
    MOVE_SLOW_TABLE,
    ROTATE_FROM_PLANNER,
    ROTATE_TABLE,
)
from quad_nav.config.tables.trajectory_planner import TRAJECTORY_PLANNER_TABLE
from quad_nav.control.dwa_planner import DwaParams
from quad_nav.control.trajectory_planner import TrajectoryPlannerParams
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.layered import CostmapParams
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.scan_validator import ScanValidatorParams
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.costmap.voxel import VoxelLayerParams
from quad_nav.navigator.control_supervisor import ProgressParams
from quad_nav.navigator.navigator import NavigatorParams
from quad_nav.peers.coordinator import PeerParams
from quad_nav.plan.carrot import CarrotParams
from quad_nav.plan.global_planner import SearchPlannerParams
from quad_nav.plan.navfn import NavfnParams
from quad_nav.recovery import ClearCostmapParams, MoveSlowAndClearParams, RotateParams

PAGE = Path(__file__).resolve().parents[2] / "docs" / "parameters.md"

ROTATE = Table(fixed=ROTATE_TABLE.fixed + ROTATE_FROM_PLANNER)
# (dataclass, table, fields that are read in another way than from one row)
PAIRS = [
    (NavigatorParams, MOVE_BASE_TABLE, {"recovery_behaviors", "progress"}),
    (TrajectoryPlannerParams, TRAJECTORY_PLANNER_TABLE, set()),
    (NavfnParams, NAVFN_TABLE, set()),
    (SearchPlannerParams, GLOBAL_PLANNER_TABLE, set()),
    (CarrotParams, CARROT_TABLE, set()),
    (ClearCostmapParams, CLEAR_COSTMAP_TABLE, {"layer_names"}),
    (RotateParams, ROTATE, set()),
    (
        MoveSlowAndClearParams,
        MOVE_SLOW_TABLE,
        {
            "translation_fields",
            "rotation_fields",
            "named_translation_field",
            "named_rotation_field",
        },
    ),
    (CostmapParams, COSTMAP_TABLE, {"layers"}),
    (ObstacleLayerParams, OBSTACLE_LAYER_TABLE, {"sources", "track_unknown_space"}),
    (VoxelLayerParams, VOXEL_LAYER_TABLE, {"sources", "track_unknown_space"}),
    (SourceParams, SOURCE_TABLE, {"name", "obstacle_range_m", "raytrace_range_m"}),
    (InflationLayerParams, INFLATION_LAYER_TABLE, set()),
    (StaticLayerParams, STATIC_LAYER_TABLE, set()),
]
TABLES = [*(table for _, table, _ in PAIRS), FIXES_TABLE]
SWITCH_OWNERS = [
    ClearCostmapParams,
    DwaParams,
    MoveSlowAndClearParams,
    NavigatorParams,
    ObstacleLayerParams,
    PeerParams,
    ProgressParams,
    RotateParams,
    ScanValidatorParams,
    StaticLayerParams,
    TrajectoryPlannerParams,
    VoxelLayerParams,
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
def test_defaults_are_valid(table):
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
