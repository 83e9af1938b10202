"""What ``bench/soak_ros.py`` finds wrong with a flight."""

import sys
from pathlib import Path

BENCH = Path(__file__).resolve().parents[2] / "bench"
sys.path.insert(0, str(BENCH))

from soak_ros import Stretch, grown, late  # noqa: E402


def test_a_robot_with_fewer_or_more_commands_in_one_stretch_is_late():
    stretches = [Stretch(1.0, [9.95, 10.05], 0.1), Stretch(1.0, [9.85, 10.12], 0.3)]
    assert late(stretches, 10.0, 0.1) == [
        "quad0 got 9.85 commands/s in stretch 2",
        "quad1 got 10.12 commands/s in stretch 2",
    ]
    assert late(stretches, 10.0, 0.2) == []


def test_memory_may_grow_by_a_twentieth_after_the_first_stretch():
    def stretch(**memory_mb):
        return Stretch(1.0, [10.0], 0.1, memory_mb)

    first = stretch(fleet0=100.0, simulator=200.0)
    assert grown([first, stretch(fleet0=105.0, simulator=190.0, rviz_fleet=300.0)]) == []
    assert grown([first, stretch(fleet0=106.0)]) == [
        "fleet0 has grown from 100 MB to 106 MB",
        "simulator is gone",
    ]
