"""The parts of the drawing that need no page: messages, projection, colours, goals and samples."""

from __future__ import annotations

import base64
import functools
import http.server
import threading

import numpy as np
import pytest

from quad_web.arena import STATIC
from quad_web.view.codec import encode
from quad_web.view.state import Item


class _Quiet(http.server.SimpleHTTPRequestHandler):
    extensions_map = {".js": "text/javascript"}

    def log_message(self, *args):
        pass


@pytest.fixture(scope="module")
def modules(browser):
    """A page of the folder of modules, served without the page of the flight."""
    handler = functools.partial(_Quiet, directory=str(STATIC))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page = browser.new_page()
        page.goto(f"http://127.0.0.1:{server.server_port}/codec.js")
        yield page
        page.close()
        server.shutdown()


@pytest.fixture
def run(modules):
    """Return a function that runs JavaScript with the names of a module."""

    def evaluate(module, names, body, argument=None):
        return modules.evaluate(
            f"async (argument) => {{ const {{ {names} }} = await import('/{module}'); {body} }}",
            argument,
        )

    return evaluate


def test_messages_are_decoded_as_they_were_encoded(run):
    body = """
        const bytes = Uint8Array.from(atob(argument), (letter) => letter.charCodeAt(0));
        const { header, items, removed } = await decode(bytes.buffer);
        const plain = ({ values, shape }) => ({ values: [...values].slice(0, 4), shape });
        const arrays = (item) =>
          Object.entries(item.arrays).map(([name, array]) => [name, plain(array)]);
        return { header, removed, items: items.map((item) => [item.key, item.data, arrays(item)]) };
    """
    message = encode(
        [
            Item("poses", {"stamp_s": 1.5}, {"pose": np.array([[1, 2], [3, 4.5]], np.float32)}),
            Item("samples", None, {"times": np.array([0.1]), "ids": np.array([7, -8], np.int32)}),
            # Large enough to be compressed.
            Item("global_costmap/3", {"x": -1}, {"costs": np.full((80, 60), -1, np.int8)}),
        ],
        ["plan/1"],
        seq=5,
    )
    decoded = run("codec.js", "decode", body, base64.b64encode(message).decode())
    assert (decoded["header"]["seq"], decoded["removed"]) == (5, ["plan/1"])
    poses, samples, costmap = decoded["items"]
    assert poses[:2] == ["poses", {"stamp_s": 1.5}]
    assert poses[2] == [["pose", {"values": [1, 2, 3, 4.5], "shape": [2, 2]}]]
    assert samples[2] == [
        ["times", {"values": [0.1], "shape": [1]}],
        ["ids", {"values": [7, -8], "shape": [2]}],
    ]
    assert costmap[2] == [["costs", {"values": [-1] * 4, "shape": [80, 60]}]]


def test_the_store_knows_what_has_changed(run):
    body = """
        const store = new Store();
        const item = (key) => ({ key, data: key, arrays: {} });
        store.apply({ items: ["poses", "scan/0", "scan/12"].map(item), removed: [] });
        const before = store.get("poses").revision;
        store.apply({ items: [item("poses")], removed: ["scan/0"] });
        const robots = store.all("scan").map(({ robot }) => robot);
        const isNew = store.get("poses").revision > before;
        store.clear();
        return [isNew, robots, store.all("scan").length, store.get("poses") === undefined];
    """
    assert run("store.js", "Store", body) == [True, [12], 0, True]


def test_the_viewport_projects_and_zooms_about_a_pixel(run):
    body = """
        const viewport = Object.assign(new Viewport(), { width: 200, height: 100, scale: 10 });
        const corner = viewport.toScreen(1, 2);
        viewport.zoomAt(130, 20, 2);
        const kept = viewport.toWorld(130, 20);
        const insets = { left: 50, right: 10, top: 5, bottom: 15 };
        viewport.fit({ minX: 0, minY: 0, maxX: 7, maxY: 2 }, insets);
        const ends = [viewport.toScreen(0, 0), viewport.toScreen(7, 2)];
        return { corner, kept, scale: viewport.scale, ends };
    """
    got = run("viewport.js", "Viewport", body)
    assert got["corner"] == [110, 30]  # y is up in the arena and down on the screen
    assert got["kept"] == pytest.approx([3, 3])  # 30 pixels right of and above the middle
    assert got["scale"] == pytest.approx(20)  # 140 pixels for 7 m, 80 for 2 m
    assert got["ends"][0] == pytest.approx([50, 65])
    assert got["ends"][1] == pytest.approx([190, 25])
    body = """
        const points = [[0, 0], [10, 0], [30, 0]];
        const lengths = [0.7, 3.2, 19, 50].map((m) => formatLength(roundLength(m)));
        const hit = [[6, 0], [4, 0], [20, 0]];
        return [lengths, hit.map(([x, y]) => nearest(points, x, y, (i) => 8 - i))];
    """
    names = "nearest, roundLength, formatLength"
    assert run("viewport.js", names, body) == [["50 cm", "2 m", "10 m", "50 m"], [1, 0, -1]]


def test_costs_have_the_colours_of_rviz_cell_by_cell(run):
    body = """
        const canvas = document.createElement("canvas");
        paintCosts(canvas, { values: Int8Array.from([0, 99, -1, 100, 0, 0]), shape: [3, 2] });
        const { data } = canvas.getContext("2d").getImageData(0, 0, 2, 3);
        return [[0, 1, 50, 98, 99, 100, 101, -1, -128].map(costColour), [...data.slice(4, 16)]];
    """
    colours, painted = run("colours.js", "costColour, paintCosts", body)
    assert colours == [
        [0, 0, 0, 0],
        [2, 0, 253, 255],
        [127, 0, 128, 255],
        [249, 0, 6, 255],
        [0, 255, 255, 255],
        [255, 0, 255, 255],
        [0, 255, 0, 255],
        [0x70, 0x89, 0x86, 255],
        [255, 0, 0, 255],
    ]
    assert painted == [0, 255, 255, 255, 0x70, 0x89, 0x86, 255, 255, 0, 255, 255]


def test_a_quadcopter_leans_to_where_its_thrust_pulls_it(run):
    body = """
        const lean = (roll, pitch, yaw) => tiltOf({ roll, pitch, yaw });
        return [lean(0, 0.2, 0), lean(0, 0.2, Math.PI / 2), lean(0.1, 0, 0)];
    """
    ahead, ahead_north, right = run("fleet.js", "tiltOf", body)
    assert ahead == pytest.approx([np.sin(0.2), 0])  # nose down: ahead
    assert ahead_north == pytest.approx([0, np.sin(0.2)])
    assert right == pytest.approx([0, -np.sin(0.1)])  # right side down: to the right


def test_obstacles_are_found_under_the_pointer(run):
    body = """
        const around = (a, b) => [[a, b], [-a, b], [-a, -b], [a, -b]];
        const diamond = [[0.5, 0], [0, 0.5], [-0.5, 0], [0, -0.5]];
        const box = { x: 1, y: 1, outline: around(1, 0.1), reach: 1.1, yaw: Math.PI / 2,
          name: "box" };
        const pillar = { x: 4, y: 0, outline: diamond, reach: 0.5, yaw: 0, name: "pillar" };
        const cart = { x: 4, y: 3, outline: around(0.5, 0.5), reach: 0.71, yaw: 0, name: "cart" };
        const fleet = { scene: { solids: [box, pillar], walls: [] }, obstacles: [cart] };
        return [[1, 1.9], [1.9, 1], [4.2, 0.2], [4.3, 0.3], [4.4, 2.6]].map(
          ([x, y]) => solidAt(fleet, x, y)?.name ?? null);
    """
    assert run("fleet.js", "solidAt", body) == ["box", None, "pillar", None, "cart"]


def test_samples_of_the_last_minute_are_kept(run):
    body = """
        const history = new SampleHistory();
        const rows = (...values) => ({ values: Float32Array.from(values), shape: [2, 4] });
        const sample = (time_s, a, b) =>
          ({ data: { time_s }, arrays: { values: rows(a, 0, 0, 0, b, 0, 0, 0) } });
        const first = sample(10, 1, 5);
        first.arrays.times = { values: Float64Array.from([8, 9]), shape: [2] };
        first.arrays.history = {
          values: Float32Array.from([3, 0, 0, 0, 4, 0, 0, 0, NaN, 0, 0, 0, 2, 0, 0, 0]),
          shape: [2, 2, 4] };
        history.add(first);
        const all = { times: [...history.times], line: history.line(1, 0), ...history.band(0) };
        history.add(sample(10.01, 0, 0)); // too close to the last one
        history.add(sample(69.5, 7, 8)); // more than a minute after the first two
        const later = [...history.times];
        history.add(sample(2, 7, 8)); // a recording that is played from another time on
        return { all, later, again: [...history.times] };
    """
    band = {"least": [3, 2, 1], "greatest": [4, 2, 5]}
    assert run("samples.js", "SampleHistory", body) == {
        "all": {"times": [8, 9, 10], "line": [4, 2, 5], **band},
        "later": [10, 69.5],
        "again": [2],
    }


def test_a_large_fleet_has_a_band_with_gaps_and_the_line_of_the_selected_robot(run):
    body = """
        const layers = { count: 20, times: [0, 1], line: () => [1, 2], band: () =>
          ({ least: [0, 1], greatest: [3, NaN] }) };
        const red = () => "#ff0000";
        const one = (selected, count) => seriesOptions({ ...layers, count }, selected, red)
          .filter(({ xAxisIndex }) => xAxisIndex === 3);
        const low = [[0, 1], [1, 2], [2, null], [3, 4], [4, null], [5, 1], [6, 1]];
        const high = low.map(([x, y]) => [x, y === null ? null : y + 5]);
        return [...[one(4, 20), one(1, 2)].map((series) =>
          series.map(({ type, data, lineStyle }) => [type, data, lineStyle?.width ?? null])),
          stretches(low, high)];
    """
    large, small, outlines = run("samples.js", "seriesOptions, stretches", body)
    line = [[-1, 1000], [0, 2000]]  # milliseconds
    assert large == [["custom", [[-1, 0, 3000], [0, 1000, None]], None], ["line", line, 3]]
    assert small == [["line", line, 1.5], ["line", line, 3]]
    # One sample alone is no band.
    assert outlines == [[[0, 6], [1, 7], [1, 2], [0, 1]], [[5, 6], [6, 6], [6, 1], [5, 1]]]
