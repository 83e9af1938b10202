"""Parameters of ``amcl``, with upstream's names, defaults, ranges and sentences of our own."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Tuple

from quad_nav.parameter import (
    Choice,
    InvalidValue,
    fixed_flag,
    fixed_number,
    fixed_text,
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


def _model(name: str, default: str, models: Tuple[str, ...], sentence: str) -> Any:
    choices = tuple(Choice(one.replace("-", "_") + "_const", one, one) for one in models)
    expected = "one of " + ", ".join(models)
    return text(name, default, expected, sentence, choices=choices, choices_description=sentence)


def _frame(name: str, default: str, sentence: str) -> Any:
    return text(name, default, "a frame", sentence, convert=lambda given: given.lstrip("/"))


def _alpha(number_: int, sentence: str) -> Any:
    return number(f"odom_alpha{number_}", 0.2, "", 0, 10, sentence)


@dataclass(frozen=True)
class AmclParams:
    """Parameters of ``amcl``, in the order of upstream's ``.cfg`` file, then those read once."""

    min_particles: int = whole("min_particles", 100, "", 0, 1000, "Fewest particles.")
    max_particles: int = whole("max_particles", 5000, "", 0, 10000, "Most particles.")
    kld_err: float = number("kld_err", 0.01, "", 0, 1, "Largest error of the distribution.")
    kld_z: float = number("kld_z", 0.99, "", 0, 1, "Quantile itself, not its probability.")
    update_min_d_m: float = number("update_min_d", 0.2, "m", 0, 5, "Motion in x or y per update.")
    update_min_a_rad: float = number(
        "update_min_a", math.pi / 6, "rad", 0, 2 * math.pi, "Turn per update."
    )
    resample_interval: int = whole("resample_interval", 2, "", 0, 20, "Updates per resampling.")
    transform_tolerance_s: float = number(
        "transform_tolerance", 0.1, "s", 0, 2, "How far transforms are stamped into the future."
    )
    recovery_alpha_slow: float = number(
        "recovery_alpha_slow", 0.001, "", 0, 0.5, "Rate of the slow average weight."
    )
    recovery_alpha_fast: float = number(
        "recovery_alpha_fast", 0.1, "", 0, 1, "Rate of the fast average weight; 0: no random poses."
    )
    do_beamskip: bool = flag(
        "do_beamskip", False, "Leave out beams that few particles agree with (prob model)."
    )
    beam_skip_distance_m: float = number(
        "beam_skip_distance", 0.5, "m", 0, 2, "A beam agrees if it ends closer to an obstacle."
    )
    beam_skip_threshold: float = number(
        "beam_skip_threshold", 0.3, "", 0, 1, "A beam counts if more of the particles agree."
    )
    tf_broadcast: bool = flag("tf_broadcast", True, "Publish the transform map -> odom.")
    force_update_after_initialpose: bool = flag(
        "force_update_after_initialpose", False, "Update after an initial pose without motion."
    )
    force_update_after_set_map: bool = flag(
        "force_update_after_set_map", False, "Update after `set_map` without motion."
    )
    gui_publish_rate_hz: float = signed("gui_publish_rate", -1.0, "Hz", -1, 100, "Not used.")
    save_pose_rate_hz: float = signed(
        "save_pose_rate", 0.5, "Hz", -1, 10, "Rate of saving the pose as parameters; -1: never."
    )
    use_map_topic: bool = flag("use_map_topic", False, "Take maps from the topic (read once).")
    first_map_only: bool = flag("first_map_only", False, "Take the first map alone (read once).")
    laser_min_range_m: float = signed(
        "laser_min_range", -1.0, "m", -1, 1000, "Least range; -1: the scan's."
    )
    laser_max_range_m: float = signed(
        "laser_max_range", -1.0, "m", -1, 1000, "Largest range; -1: the scan's."
    )
    laser_max_beams: int = whole("laser_max_beams", 30, "", 0, 250, "Beams of a scan in use.")
    laser_z_hit: float = number("laser_z_hit", 0.95, "", 0, 1, "Weight of hits.")
    laser_z_short: float = number("laser_z_short", 0.1, "", 0, 1, "Weight of short ranges (beam).")
    laser_z_max: float = number("laser_z_max", 0.05, "", 0, 1, "Weight of largest ranges (beam).")
    laser_z_rand: float = number("laser_z_rand", 0.05, "", 0, 1, "Weight of random ranges.")
    laser_sigma_hit_m: float = number(
        "laser_sigma_hit", 0.2, "m", 0, 10, "Standard deviation of hits."
    )
    laser_lambda_short: float = number(
        "laser_lambda_short", 0.1, "1/m", 0, 10, "Decay of short ranges (beam)."
    )
    laser_likelihood_max_dist_m: float = number(
        "laser_likelihood_max_dist", 2.0, "m", 0, 20, "Largest distance in the likelihood field."
    )
    laser_model_type: str = _model(
        "laser_model_type", LIKELIHOOD_FIELD, LASER_MODELS, "Model of the laser."
    )
    odom_model_type: str = _model(
        "odom_model_type",
        "diff",
        ODOM_MODELS,
        "Model of the odometry; quadcopters: omni-corrected.",
    )
    odom_alpha1: float = _alpha(1, "Noise of turns from turns.")
    odom_alpha2: float = _alpha(2, "Noise of turns from motion.")
    odom_alpha3: float = _alpha(3, "Noise of motion from motion.")
    odom_alpha4: float = _alpha(4, "Noise of motion from turns.")
    odom_alpha5: float = _alpha(5, "Noise sideways from motion (omni).")
    odom_frame_id: str = _frame("odom_frame_id", "odom", "Frame of the odometry.")
    base_frame_id: str = _frame("base_frame_id", "base_link", "Frame of the robot.")
    global_frame_id: str = _frame("global_frame_id", "map", "Frame of the map.")
    restore_defaults: bool = flag("restore_defaults", False, "Back to the values at the start.")
    beam_skip_error_threshold: float = fixed_number(
        "beam_skip_error_threshold", 0.9, "", "If more of the beams are skipped, all count."
    )
    selective_resampling: bool = fixed_flag(
        "selective_resampling", False, "Resample only below half the effective particles."
    )
    std_warn_level_x_m: float = fixed_number(
        "std_warn_level_x", 0.2, "m", "Standard deviation in x that is warned about."
    )
    std_warn_level_y_m: float = fixed_number(
        "std_warn_level_y", 0.2, "m", "Standard deviation in y that is warned about."
    )
    std_warn_level_yaw_rad: float = fixed_number(
        "std_warn_level_yaw", 0.1, "rad", "Standard deviation of the yaw that is warned about."
    )
    seed: int = fixed_whole(
        "seed", -1, "Seed of random numbers; -1: another at each start.", own=True
    )
    peer_radius_m: float = fixed_number(
        "peer_radius", 0.5, "m", "Beams that end so near a known peer are left out.", own=True
    )
    peers_topic: str = fixed_text(
        "peers_topic", "", "a topic or nothing", "States of all robots; empty: no peers.", own=True
    )
    upstream: bool = fixed_flag("upstream", False, "Behave as C++ amcl, bugs included.", own=True)


def read_params(values: Mapping[str, Any]) -> Tuple[AmclParams, List[str]]:
    """Read parameters by their ROS names; others are ignored.

    Returns:
        The parameters, and a line for each value that is not valid and so is left at its default.
    """
    right: Dict[str, Any] = {}
    faults: List[str] = []
    for one in parameters_of(AmclParams):
        if one.name not in values:
            continue
        try:
            right[one.field] = one.field_value(one.check(values[one.name]))
        except InvalidValue as fault:
            faults.append(f"{one.name}: {fault}; using {one.in_force}")
    return AmclParams(**right), faults
