"""Parameters of ``amcl``, with upstream's names, defaults and ranges."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Tuple

from quad_nav.parameter import (
    ANY,
    Choice,
    InvalidValue,
    fixed_flag,
    fixed_number,
    fixed_whole,
    flag,
    number,
    parameters_of,
    signed,
    text,
    whole,
)

BEAM, LIKELIHOOD_FIELD, LIKELIHOOD_FIELD_PROB = "beam", "likelihood_field", "likelihood_field_prob"
LASER_MODELS = (BEAM, LIKELIHOOD_FIELD, LIKELIHOOD_FIELD_PROB)
ODOM_MODELS = ("diff", "omni", "diff-corrected", "omni-corrected")
_TURN = math.pi / 6
_YAW_VARIANCE = (math.pi / 12) * (math.pi / 12)


def _model(name: str, default: str, models: Tuple[str, ...], sentence: str) -> Any:
    choices = tuple(Choice(one.replace("-", "_") + "_const", one, one) for one in models)
    more = {"choices": choices, "choices_description": sentence}
    return text(name, default, "one of " + ", ".join(models), sentence, **more)


def _frame(name: str, default: str, sentence: str) -> Any:
    return text(name, default, "a frame", sentence, convert=lambda given: given.lstrip("/"))


def _share(name: str, default: float, sentence: str, high: float = 1) -> Any:
    return number(name, default, "", 0, high, sentence)


@dataclass(frozen=True)
class AmclParams:
    """Parameters of ``amcl``, in the order of upstream's ``.cfg`` file, then those read once."""

    min_particles: int = whole("min_particles", 100, "", 0, 1000, "Fewest particles.")
    max_particles: int = whole("max_particles", 5000, "", 0, 10000, "Most particles.")
    kld_err: float = _share("kld_err", 0.01, "Largest error of the distribution.")
    kld_z: float = _share("kld_z", 0.99, "Normal quantile itself, not its probability.")
    update_min_d_m: float = number("update_min_d", 0.2, "m", 0, 5, "Way in x or y per update.")
    update_min_a_rad: float = number("update_min_a", _TURN, "rad", 0, 2 * math.pi, "Turn per it.")
    resample_interval: int = whole("resample_interval", 2, "", 0, 20, "Updates per resampling.")
    transform_tolerance_s: float = number("transform_tolerance", 0.1, "s", 0, 2, "Lead of stamps.")
    recovery_alpha_slow: float = _share("recovery_alpha_slow", 0.001, "Of the slow average.", 0.5)
    recovery_alpha_fast: float = _share("recovery_alpha_fast", 0.1, "Of the fast one; 0: none.")
    do_beamskip: bool = flag("do_beamskip", False, "Skip beams that few particles agree with.")
    beam_skip_distance_m: float = number("beam_skip_distance", 0.5, "m", 0, 2, "Beam agrees below.")
    beam_skip_threshold: float = _share("beam_skip_threshold", 0.3, "Share that has to agree.")
    tf_broadcast: bool = flag("tf_broadcast", True, "Publish the transform of odom in the map.")
    force_update_after_initialpose: bool = flag(
        "force_update_after_initialpose", False, "Update after an initial pose without motion."
    )
    force_update_after_set_map: bool = flag(
        "force_update_after_set_map", False, "Update after `set_map` without motion."
    )
    gui_publish_rate_hz: float = signed("gui_publish_rate", -1.0, "Hz", -1, 100, "Not used.")
    save_pose_rate_hz: float = signed("save_pose_rate", 0.5, "Hz", -1, 10, "Of saving; -1: never.")
    use_map_topic: bool = flag("use_map_topic", False, "Take maps from the topic; read once.")
    first_map_only: bool = flag("first_map_only", False, "Take one map from it; read once.")
    laser_min_range_m: float = signed("laser_min_range", -1.0, "m", -1, 1000, "-1: the scan's.")
    laser_max_range_m: float = signed("laser_max_range", -1.0, "m", -1, 1000, "-1: the scan's.")
    laser_max_beams: int = whole("laser_max_beams", 30, "", 0, 250, "Beams of a scan in use.")
    laser_z_hit: float = _share("laser_z_hit", 0.95, "Weight of hits.")
    laser_z_short: float = _share("laser_z_short", 0.1, "Weight of short ranges (beam).")
    laser_z_max: float = _share("laser_z_max", 0.05, "Weight of largest ranges (beam).")
    laser_z_rand: float = _share("laser_z_rand", 0.05, "Weight of random ranges.")
    laser_sigma_hit_m: float = number("laser_sigma_hit", 0.2, "m", 0, 10, "Deviation of hits.")
    laser_lambda_short: float = number("laser_lambda_short", 0.1, "1/m", 0, 10, "Decay (beam).")
    laser_likelihood_max_dist_m: float = number(
        "laser_likelihood_max_dist", 2.0, "m", 0, 20, "Largest distance in the likelihood field."
    )
    laser_model_type: str = _model("laser_model_type", LIKELIHOOD_FIELD, LASER_MODELS, "Laser.")
    odom_model_type: str = _model("odom_model_type", "diff", ODOM_MODELS, "Model of the odometry.")
    odom_alpha1: float = _share("odom_alpha1", 0.2, "Noise of turns from turns.", 10)
    odom_alpha2: float = _share("odom_alpha2", 0.2, "Noise of turns from motion.", 10)
    odom_alpha3: float = _share("odom_alpha3", 0.2, "Noise of motion from motion.", 10)
    odom_alpha4: float = _share("odom_alpha4", 0.2, "Noise of motion from turns.", 10)
    odom_alpha5: float = _share("odom_alpha5", 0.2, "Noise sideways from motion (omni).", 10)
    odom_frame_id: str = _frame("odom_frame_id", "odom", "Frame of the odometry.")
    base_frame_id: str = _frame("base_frame_id", "base_link", "Frame of the robot.")
    global_frame_id: str = _frame("global_frame_id", "map", "Frame of the map.")
    restore_defaults: bool = flag("restore_defaults", False, "Back to the values at the start.")
    beam_skip_error_threshold: float = fixed_number(
        "beam_skip_error_threshold", 0.9, "", "From this share of skipped beams on all count."
    )
    selective_resampling: bool = fixed_flag(
        "selective_resampling", False, "Resample below half the effective particles only."
    )
    initial_pose_x_m: float = fixed_number("initial_pose_x", 0.0, "m", "With the first map.", ANY)
    initial_pose_y_m: float = fixed_number("initial_pose_y", 0.0, "m", "The same.", ANY)
    initial_pose_a_rad: float = fixed_number("initial_pose_a", 0.0, "rad", "The same.", ANY)
    initial_cov_xx: float = fixed_number("initial_cov_xx", 0.25, "m^2", "Its variance in x.")
    initial_cov_yy: float = fixed_number("initial_cov_yy", 0.25, "m^2", "Its variance in y.")
    initial_cov_aa: float = fixed_number("initial_cov_aa", _YAW_VARIANCE, "rad^2", "Of the yaw.")
    std_warn_level_x_m: float = fixed_number("std_warn_level_x", 0.2, "m", "Warned about above.")
    std_warn_level_y_m: float = fixed_number("std_warn_level_y", 0.2, "m", "The same.")
    std_warn_level_yaw_rad: float = fixed_number("std_warn_level_yaw", 0.1, "rad", "The same.")
    seed: int = fixed_whole("seed", -1, "Of random numbers; -1: another at each start.", own=True)
    robot: int = fixed_whole("robot", -1, "Number of the robot; -1: that in its names.", own=True)
    peer_radius_m: float = fixed_number(
        "peer_radius", 0.5, "m", "Beams that end so near a peer are left out; 0: none.", own=True
    )
    lost_above_m: float = fixed_number(
        "lost_above", 0.5, "m", "Deviation above which no transform is sent.", own=True
    )
    lost_below: float = fixed_number(
        "lost_below", 0.5, "", "Fit below which no transform is sent; 0: none.", own=True
    )
    upstream: bool = fixed_flag("upstream", False, "Behave as C++ amcl, bugs included.", own=True)


def read_params(values: Mapping[str, Any]) -> Tuple[AmclParams, List[str]]:
    """Read parameters by their ROS names; others are ignored.

    Returns:
        The parameters, and a line for each value that is not valid: its default counts.
    """
    right: Dict[str, Any] = {}
    faults: List[str] = []
    for one in parameters_of(AmclParams):
        if one.name in values:
            try:
                right[one.field] = one.field_value(one.check(values[one.name]))
            except InvalidValue as fault:
                faults.append(f"{one.name}: {fault}; the default counts: {one.in_force}")
    return AmclParams(**right), faults
