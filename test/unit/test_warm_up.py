"""The little mission that compiles the kernels."""
from __future__ import annotations

from quad_nav import warm_up
from quad_nav.config import load


def test_every_kernel_of_a_cycle_has_run(monkeypatch):
    """The mission goes through scans, costmaps, a plan and a control cycle."""
    ticks = []
    build = warm_up.build_navigator

    def recording(configuration):
        navigator = build(configuration)
        tick = navigator.tick
        navigator.tick = lambda *arguments: ticks.append(tick(*arguments)) or ticks[-1]
        return navigator
    monkeypatch.setattr(warm_up, "build_navigator", recording)
    warm_up.main()
    assert any(tick.plan is not None for tick in ticks)
    assert any(tick.control is not None for tick in ticks)
    assert set(ticks[0].windows) == {"global", "local"}
    assert not ticks[0].windows["local"].is_empty


def test_any_configuration_can_be_warmed_up():
    warm_up.warm_up(load({"global_costmap": {"static_map": True}}))
