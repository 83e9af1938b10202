"""Steps that are due at given wall times."""

from __future__ import annotations

from quad_nav.sim.pacing import Pacer, RateMeter


def run(pacer: Pacer, *wall_s: float) -> list:
    return [pacer.pop_due(t) for t in wall_s]


def test_steps_are_due_at_the_rate():
    pacer = Pacer(rate=2.0, step_s=0.25)  # a step each 0.125 s
    pacer.start(100.0)
    assert run(pacer, 100.0, 100.12, 100.125, 100.2, 100.25, 100.3) == [0, 0, 1, 0, 1, 0]


def test_wait_until_steps_are_due():
    pacer = Pacer(rate=1.0, step_s=0.25)
    pacer.start(10.0)
    assert pacer.wait_s(10.0, 1) == 0.25
    assert pacer.wait_s(10.0, 3) == 0.75
    assert pacer.wait_s(11.0, 1) == 0.0


def test_a_slow_simulation_catches_up_at_most_a_tenth_of_a_second():
    pacer = Pacer(rate=1.0, step_s=1.0 / 128)
    pacer.start(0.0)
    assert run(pacer, 5.0, 5.0, 5.005, 5.009) == [13, 0, 1, 0]


def test_bursts_are_bounded_at_high_rates():
    pacer = Pacer(rate=1000.0, step_s=0.01)
    pacer.start(0.0)
    assert run(pacer, 1.0, 1.0) == [24, 24]


def test_pauses_are_not_caught_up():
    pacer = Pacer(rate=1.0, step_s=0.01)
    pacer.start(0.0)
    pacer.pop_due(0.05)
    pacer.start(9.0)
    assert run(pacer, 9.0, 9.0125) == [0, 1]


def test_meter_reads_the_factor_since_the_last_reading():
    meter = RateMeter()
    meter.start(10.0, 1.0)
    assert meter.read(12.0, 2.0) == 0.5
    assert meter.read(13.0, 4.0) == 2.0
    assert meter.read(13.0, 4.0) == 0.0
