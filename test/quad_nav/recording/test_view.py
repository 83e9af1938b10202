"""The view in rerun: solids, and what is said when it cannot be had."""

from __future__ import annotations

import math
import sys
import types

import numpy as np
import pytest
from recorded_flight import setup

from quad_nav.errors import InputError
from quad_nav.offline.run import fly
from quad_nav.recording import viewer as view
from quad_nav.recording.viewer import View
from quad_nav.recording.viewer_solids import solid
from quad_nav.topics.markers import CUBE, CUBE_LIST, CYLINDER, SPHERE, Marker


class Made:
    """Stands in for an archetype of rerun: what it was made with."""

    def __init__(self, kind, args, fields):
        self.kind, self.args, self.fields = kind, args, fields


class FakeRerun(types.ModuleType):
    """Notes what is logged; the real one is an optional extra."""

    def __init__(self):
        super().__init__("rerun")
        self.components = types.SimpleNamespace(
            FillMode=types.SimpleNamespace(Solid="solid", MajorWireframe="wires")
        )
        self.ViewCoordinates = types.SimpleNamespace(RIGHT_HAND_Z_UP="z up")
        self.calls, self.logged, self.now_s = [], [], None
        blueprint = types.ModuleType("rerun.blueprint")
        blueprint.Blueprint = blueprint.Spatial3DView = lambda *args, **fields: None
        self.blueprint = blueprint

    def __getattr__(self, name):
        if name[:1].isupper():
            return lambda *args, **fields: Made(name, args, fields)
        if name in ("init", "save", "connect_tcp", "disconnect", "send_blueprint"):
            return lambda *args: self.calls.append((name, *args))
        raise AttributeError(name)

    def set_time_seconds(self, timeline, seconds):
        assert timeline == "flight"
        self.now_s = seconds

    def log(self, entity, made, static=False):
        self.logged.append((entity, None if static else self.now_s, made))


@pytest.fixture
def rerun(monkeypatch):
    fake = FakeRerun()
    monkeypatch.setitem(sys.modules, "rerun", fake)
    monkeypatch.setitem(sys.modules, "rerun.blueprint", fake.blueprint)
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setenv("PATH", "/bin")  # put back afterwards
    return fake


def marker(kind, alpha=1.0, **fields):
    return Marker(
        "map", "solids", 0, kind, (1.0, 2.0, 3.0), (0.5, 0.5, 2.0), (1.0, 0.0, 0.2, alpha), **fields
    )


@pytest.mark.parametrize(
    "kind, alpha, made",
    [
        (CUBE, 1.0, "Boxes3D"),
        (CUBE, 0.3, "Boxes3D"),
        (CYLINDER, 1.0, "Mesh3D"),
        (CYLINDER, 0.3, "LineStrips3D"),
        (SPHERE, 1.0, "Ellipsoids3D"),
    ],
)
def test_every_shape_has_its_solid(rerun, kind, alpha, made):
    shown = solid(rerun, marker(kind, alpha))
    assert shown.kind == made
    if kind == CUBE:
        assert shown.fields["fill_mode"] == ("solid" if alpha == 1.0 else "wires")
        assert shown.fields["colors"] == [[255, 0, 51]]


def test_a_cylinder_s_mesh_is_closed_and_faces_outwards(rerun):
    """The signed volume of a prism of 24 sides is half of n r^2 sin(2 pi / n) h."""
    mesh = solid(rerun, marker(CYLINDER)).fields
    corners = mesh["vertex_positions"][mesh["triangle_indices"]] - (1.0, 2.0, 3.0)
    volume = (
        np.sum(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6.0
    )
    assert volume == pytest.approx(12 * 0.25**2 * math.sin(2 * math.pi / 24) * 2.0)


def test_a_list_s_cubes_are_turned_with_it(rerun):
    boxes = solid(
        rerun, marker(CUBE_LIST, yaw_rad=math.pi / 2, points_m=((5.0, -3.0, 1.0), (5.0, -4.0, 1.0)))
    ).fields
    assert boxes["centers"] == pytest.approx(np.array([[3.0, 5.0, 1.0], [4.0, 5.0, 1.0]]))
    assert len(boxes["sizes"]) == 2


def test_a_flight_is_saved_with_its_parts(rerun, tmp_path):
    path = tmp_path / "flight.rrd"
    summary = fly(setup(tmp_path, time_limit_s=1.0), [View(path)])
    assert [call[0] for call in rerun.calls] == ["init", "save", "send_blueprint", "disconnect"]
    entities = {entity for entity, _, _ in rerun.logged}
    assert {
        "map/obstacles/0",
        "map/walls/0",
        "map/quad0/body/0",
        "map/quad1/body",
        "map/goals",
        "map/quad0/scan",
        "map/quad0/plan",
        "map/quad1/local_plan",
        "map/quad1/trail",
    } <= entities
    bodies = [now_s for entity, now_s, _ in rerun.logged if entity == "map/quad0/body"]
    assert bodies == pytest.approx([k / 40 for k in range(41)])
    assert summary.sim_time_s == 1.0


class FakeViewer:
    """A process that listens at once, or ends."""

    returncode = None

    def __init__(self, command, **_):
        type(self).command = command

    def poll(self):
        return self.returncode


def test_without_a_file_a_viewer_is_opened_that_only_this_machine_reaches(rerun, monkeypatch):
    listening = iter([False, False, True])
    monkeypatch.setattr(view, "_is_listening", lambda: next(listening))
    monkeypatch.setattr(view.subprocess, "Popen", FakeViewer)
    View()
    assert "--bind=127.0.0.1" in FakeViewer.command
    assert [call for call in rerun.calls if call[0] in ("save", "connect_tcp")] == [
        ("connect_tcp", "127.0.0.1:9876")
    ]


def test_without_a_display_no_viewer_is_opened(rerun, monkeypatch):
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(InputError, match="no display for the viewer; expected one, or --view FILE"):
        View()


def test_a_viewer_that_does_not_start_is_reported(rerun, monkeypatch):
    monkeypatch.setattr(view, "_is_listening", lambda: False)
    monkeypatch.setattr(view.subprocess, "Popen", FakeViewer)
    monkeypatch.setattr(FakeViewer, "returncode", 3)
    with pytest.raises(
        InputError, match="does not start: rerun exited with status 3; expected a display"
    ):
        View()


@pytest.mark.parametrize(
    "name, problem",
    [
        ("flight.bag", "expected a name that ends with .rrd"),
        ("folder.rrd", "cannot be written: is a folder"),
    ],
)
def test_a_file_that_cannot_be_made_is_refused(rerun, tmp_path, name, problem):
    (tmp_path / "folder.rrd").mkdir()
    with pytest.raises(InputError, match=problem):
        View(tmp_path / name)


def test_without_rerun_the_error_names_the_package(monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(
        InputError, match=r"rerun is not installed .*pip install 'quad-nav\[view\]'"
    ):
        View()
