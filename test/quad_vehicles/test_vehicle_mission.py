"""The tutorial's mission through the bridge, flown by stand-ins on a virtual clock."""

from __future__ import annotations

from vehicles.missions import MOST_M, fly_vehicles, prepare

from quad_vehicles.vehicle_file import AMCL


def test_two_stand_ins_fly_the_tutorial_from_take_off_to_landing():
    flown = fly_vehicles(prepare(1, "default"), "ardupilot")
    assert (flown.reached, flown.goals, flown.contacts, flown.trouble) == (6, 6, 0, "")
    assert flown.altitude_m <= MOST_M


def test_amcl_corrects_the_drift_of_two_stand_ins():
    """Their odometry errs by 1.8 m in 72 s, if they keep their headings."""
    flown = fly_vehicles(prepare(1, "default", jitter_m=0.0), "ardupilot", AMCL)
    assert (flown.reached, flown.goals, flown.contacts, flown.trouble) == (6, 6, 0, "")
    assert flown.error_m < 0.12
