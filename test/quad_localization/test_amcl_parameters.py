"""The table of parameters has upstream's names, defaults and ranges."""

from __future__ import annotations

import math

import pytest

from quad_localization.parameters import AmclParams, read_params
from quad_nav.parameter import parameters_of

DECLARED = {one.name: one for one in parameters_of(AmclParams)}


@pytest.mark.parametrize(
    "name, default, low, high",
    [
        ("max_particles", 5000, 0, 10000),
        ("kld_z", 0.99, 0, 1),
        ("update_min_a", math.pi / 6, 0, 2 * math.pi),
        ("recovery_alpha_slow", 0.001, 0, 0.5),
        ("save_pose_rate", 0.5, -1, 10),
        ("laser_min_range", -1.0, -1, 1000),
        ("laser_sigma_hit", 0.2, 0, 10),
        ("odom_alpha4", 0.2, 0, 10),
        ("initial_cov_aa", (math.pi / 12) ** 2, None, None),
        ("std_warn_level_yaw", 0.1, None, None),
    ],
)
def test_upstreams_table(name, default, low, high):
    one = DECLARED[name]
    assert (one.default, one.low, one.high) == (pytest.approx(default), low, high)


def test_what_is_not_valid_is_left_at_its_default_and_named():
    params, faults = read_params(
        {
            "initial_pose_x": math.nan,
            "laser_model_type": "sonar",
            "odom_frame_id": "/odom3",
            "laser_max_beams": 300,
            "bag_scan_period": 1.0,
        }
    )
    assert params == AmclParams(odom_frame_id="odom3", laser_max_beams=300)
    assert [fault.split(":")[0] for fault in faults] == ["laser_model_type", "initial_pose_x"]
