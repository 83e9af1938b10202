"""What a person sees of a flight: it begins when the viewer is there, and hints fit the case."""

from __future__ import annotations

import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("rospy")

from quad_nav.ros.common import readiness  # noqa: E402
from quad_nav.ros.navigator import loop  # noqa: E402
from quad_nav.ros.sequencer.mission import MissionRunner  # noqa: E402

QUIET_RVIZ = Path(__file__).resolve().parents[3] / "rviz" / "quiet_rviz.sh"
GLSL = """[ERROR] rviz/glsl120/indexed_8bit_image.vert
rviz/glsl120/indexed_8bit_image.frag
 GLSL link result :
active samplers with a different type refer to the same texture image unit
a fault
"""


def test_a_viewer_is_waited_for_until_it_hears_the_sequencer(monkeypatch):
    subscribed = [["/goals", ["/someone"]], ["/scan0", ["/rviz_quad_multi"]]]
    master = SimpleNamespace(getSystemState=lambda: ([], subscribed, []))
    monkeypatch.setattr(readiness.rosgraph, "Master", lambda _: master)
    mission = SimpleNamespace(
        _setup=SimpleNamespace(viewers=("rviz_quad_multi", "web")),
        _goals=SimpleNamespace(resolved_name="/goals"),
        _flight=SimpleNamespace(resolved_name="/quad/flight"),
    )
    rviz, web = MissionRunner.viewers(mission)
    assert [rviz.is_met(), web.is_met()] == [False, False]
    assert rviz.missing() == "rviz_quad_multi: is not ready to show the flight"
    subscribed[0][1].append("/rviz_quad_multi")
    assert [rviz.is_met(), web.is_met()] == [True, False]
    subscribed.append(["/quad/flight", ["/web"]])
    assert [rviz.is_met(), web.is_met()] == [True, True]


@pytest.mark.parametrize(
    "is_real, robots, hint",
    [
        (False, 1, "use a lower rate:="),
        (False, 8, "use a lower rate:=, fewer robots or more hosts:="),
        (True, 1, "use a lower controller_frequency or smaller costmaps"),
    ],
)
def test_the_hint_of_a_late_loop_fits_the_case(monkeypatch, is_real, robots, hint):
    monkeypatch.setattr(loop, "is_wallclock", lambda: is_real)
    own = SimpleNamespace(_robots=[None] * robots)
    assert loop.NavigatorLoop._hint.fget(own) == hint


def test_rviz_prints_its_own_faults_alone():
    command = ["bash", str(QUIET_RVIZ), "sh", "-c", f"printf '{GLSL}' >&2"]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=True)
    assert done.stderr == "a fault\n"
