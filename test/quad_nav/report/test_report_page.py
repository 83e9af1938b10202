"""The page of a report: complete, self-contained, for any number of quadcopters."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import lru_cache

import numpy as np
import plotly.graph_objects
import pytest
from hand_made_traces import TIMES_S, fleet, flight, goal, robot
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from PIL import Image
from report_pages import Parsed, assert_loads_nothing, figures_of

from quad_nav.mission.goal import Goal
from quad_nav.report.animation import animate_flight, animation_faults
from quad_nav.report.flight_page import flight_page
from quad_nav.report.page import MAX_STRIPS, Page, write_pictures
from quad_nav.report.plot import plot_scripts

SECTIONS = "paths encounters gaps timeline motion cycles goal-table parameters".split()
PICTURES = ["paths", "distances", "timeline", "motion", "cycles"]
PLOTS = ["paths", "distances", "timeline", "motion", "cycles"]
NOBODY = np.empty(0)


@lru_cache(maxsize=None)
def page_of(count: int) -> Page:
    return flight_page(fleet(count), wall_time_s=2.0)


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2, 20])
@pytest.mark.filterwarnings("error")
def test_page_of_so_many(count):
    page = page_of(count)
    assert Parsed(page.html).sections == SECTIONS
    assert_loads_nothing(page.html)
    names = [picture.name for picture in page.pictures]
    assert [name for name in names if not name.startswith("encounter")] == PICTURES
    strips = [name for name in names if name.startswith("encounter")]
    assert len(strips) == min(count, MAX_STRIPS)  # a contact, and neighbours 0.4 m apart
    figures = figures_of(page.html)
    assert list(figures) == PLOTS
    if count < 20:  # slow with more
        for figure in figures.values():
            narrow = figure.pop("narrow")
            assert {re.split(r"[.\[]", path)[0] for path in narrow} <= {
                *figure["layout"],
                "dragmode",
            }
            assert plotly.graph_objects.Figure(figure).data
    assert "5.0 ×" in page.html  # ten seconds in two
    # Most of a page is plotly.js, 4.8 MB.
    assert count > 2 or len(page.html) - sum(map(len, plot_scripts().texts)) < 5e5


def straight(*goals):
    return flight(robot(0, (1.0, 1.0), (0.3, 0.0), goals=goals))


def cut(*goals):
    """A recording of a mission of two goals; nothing says that it has ended."""
    mission = (Goal(4.0, 1.0), Goal(9.0, 1.0))
    return flight(robot(0, (1.0, 1.0), (0.3, 0.0), goals=goals, mission=mission))


DONE = goal(0, (4.0, 1.0), 0.0, 10.0)
TURNED = replace(DONE, yaw_error_rad=-0.12)


@pytest.mark.parametrize(
    "page, texts",
    [
        (lambda: page_of(2), ["1 of 4 goals not reached; 1 contact", "3 of 4", "real-time factor"]),
        (
            lambda: page_of(20),
            [f"The {MAX_STRIPS} closest encounters of 20 are", "The 8 quadcopters of 20 that"],
        ),
        (
            lambda: flight_page(straight(TURNED, goal(1, (4.0, 1.0), 10.0, 12.0))),
            ['<th class="n">yaw error (rad)</th>', '<td class="n">-0.12</td>'],
        ),
        (
            lambda: flight_page(straight(DONE)),
            [
                "Mission completed",
                "No contact with an obstacle. The closest moment",
                "A: quad0 and the nearest obstacle or wall: gap 0.70 m at 0.0 s, above 0.5 m",
            ],
        ),
        (
            lambda: flight_page(cut(DONE, goal(1, (9.0, 1.0), 10.0))),
            [
                '<span class="verdict unclear">Mission not complete</span>\n'
                " recording covers 0.0 to 10.0 s</p>"
            ],
        ),
        (lambda: flight_page(cut(DONE)), ["Mission not complete", "1 of 2</b>"]),
        (
            lambda: flight_page(cut(goal(0, (9.0, 1.0), 0.0, 5.0, False, "no path"))),
            ["Mission failed", "recording covers 0.0 to 10.0 s; 1 of 2 goals not reached"],
        ),
    ],
)
def test_what_the_page_says(page, texts):
    html = page().html
    assert [text for text in texts if text not in html] == []
    assert "Mission completed" not in html or "real-time factor" not in html


NO_SAMPLES = robot(1, (1.0, 2.0), times_s=NOBODY)
ONE_SAMPLE = robot(0, (1.0, 1.0), times_s=TIMES_S[:1], goals=(goal(0, (2.0, 2.0), 0.0),))
UNKNOWN = {"scene": None, "seed": None, "config_name": "", "versions": {}}


@pytest.mark.parametrize(
    "trace, missing",
    [
        (flight(), 3),
        (flight(NO_SAMPLES, reason="interrupted"), 3),
        (flight(ONE_SAMPLE, NO_SAMPLES, reason="interrupted"), 0),
        (flight(robot(0, (1.0, 1.0), (0.1, 0.1)), robot(1, (3.0, 1.0)), **UNKNOWN), 2),
    ],
    ids=["no robots", "no samples", "one sample", "no scene"],
)
@pytest.mark.filterwarnings("error")
def test_flights_that_hold_little(trace, missing):
    page = flight_page(trace)
    assert Parsed(page.html).sections == SECTIONS
    assert ("Mission failed" in page.html) is bool(trace.reason)
    assert page.html.count(">Not recorded.<") == missing


@pytest.fixture
def written(monkeypatch):
    """All that is written in the figures that are saved, and the texts that are markers."""
    found = []
    draw = Figure.savefig

    def savefig(figure, *arguments, **options):
        draw(figure, *arguments, **options)
        found.extend(text.get_text() for text in figure.findobj(Text) if text.get_visible())
        markers = [
            line.get_marker() for legend in figure.legends for line in legend.findobj(Line2D)
        ]
        found.extend(marker for marker in markers if isinstance(marker, str))

    monkeypatch.setattr(Figure, "savefig", savefig)
    return found


def test_pictures_of_a_report(tmp_path, written):
    folder = tmp_path / "new" / "pictures"
    write_pictures(page_of(2), folder)
    names = [*PICTURES, "encounter_A", "encounter_B"]
    files = {f"{name}.{kind}" for name in names for kind in ("png", "svg")}
    assert {path.name for path in folder.iterdir()} == files
    for name in names:
        image = Image.open(folder / f"{name}.png")
        image.load()
        assert image.width == 1120
    assert {"close encounter", "contact", "100 %"} <= set(written)
    assert [text for text in written if "$" in text] == []  # no source of a formula


def test_plot_of_the_paths():
    """Robot 0 flies from (1, 1) with 0.5 m/s to goal 0.1 at (1, 3.5) and 0.2 at (1, 6)."""
    figure = figures_of(page_of(2).html)["paths"]
    path, start, goals = [one for one in figure["data"] if one.get("legendgroup") == "robot0"][:3]
    assert path["name"] == "quad0"
    assert (path["x"][0], path["y"][0], path["y"][-1]) == (1.0, 1.0, 6.0)
    assert path["customdata"][-1] == [10.0, 0.5]  # seconds and m/s
    assert start["text"] == ["0"]
    assert (goals["text"], goals["y"]) == (["0.1", "0.2"], [3.5, 6.0])
    second = next(one for one in figure["data"] if one.get("legendgroup") == "robot1")
    assert path["line"]["dash"] != second["line"]["dash"]
    assert path["line"]["color"] != second["line"]["color"]


def test_animation_in_the_page():
    """The flight of ten seconds has a frame each 0.1 s; all robots move in each."""
    figure = figures_of(page_of(2).html)["paths"]
    assert [frame["name"] for frame in figure["frames"]] == [f"{k / 10:.1f}" for k in range(101)]
    middle = figure["frames"][50]
    assert middle["data"] == [{"x": [1.0], "y": [3.5]}, {"x": [2.0], "y": [3.5]}]
    assert [figure["data"][k]["legendgroup"] for k in middle["traces"]] == ["robot0", "robot1"]
    steps = figure["layout"]["sliders"][0]["steps"]
    assert [step["args"][0] for step in steps] == [[frame["name"]] for frame in figure["frames"]]


def test_no_button_uploads_a_plot():
    """plotly.js 4 has one, on by default."""
    config = json.loads(re.search(r"const config = ({.*?});", plot_scripts().texts[1]).group(1))
    assert config["showSendToCloud"] is False and config["plotlyServerURL"] == ""
    assert "sendChartToCloud" in config["modeBarButtonsToRemove"]


def test_names_of_others_stay_text():
    """A name cannot end the script, add tags to a plot, or use plotly's own templates."""
    odd, trace = "</script><b>%{x}<!--", replace(fleet(2), config_name="<script>", reason="a < b")
    trace = replace(trace, robots=(replace(trace.robots[0], name=odd), trace.robots[1]))
    html = flight_page(trace).html
    assert "&lt;script&gt;" in html and "a &lt; b" in html
    assert_loads_nothing(html)
    texts = [figure for figure in figures_of(html).values()]
    assert "<" not in "".join(re.findall(r'id="figure-[^>]*>(.*?)</script>', html))
    assert "&#60;/script&#62;&#60;b&#62;&#37;{x}&#60;!--" in json.dumps(texts)
    assert odd not in json.dumps(texts)


def test_animation(tmp_path):
    flown = robot(0, (1.0, 1.0), (0.5, 0.0), times_s=TIMES_S[TIMES_S <= 2.0])
    animate_flight(flight(flown), tmp_path / "flight.gif")
    image = Image.open(tmp_path / "flight.gif")
    assert image.n_frames == 21  # two seconds at ten frames a second, and the last one
    first = image.convert("RGB")
    image.seek(20)
    assert first.getpixel((300, 300)) == (254, 254, 254)
    assert first.tobytes() != image.convert("RGB").tobytes()
    animate_flight(flight(NO_SAMPLES, scene=None), tmp_path / "no.gif")
    assert Image.open(tmp_path / "no.gif").n_frames == 1


def test_animations_that_cannot_be_written(tmp_path, monkeypatch):
    assert animation_faults(tmp_path / "flight.gif") == []
    several, suffix = animation_faults(tmp_path / "flight.avi", 2)
    assert "2 flights, expected one" in several
    assert "expected a name that ends in .gif or .mp4" in suffix
    monkeypatch.setenv("PATH", "")
    (missing,) = animation_faults(tmp_path / "flight.mp4")
    assert "needs the program ffmpeg" in missing


def localized(number, east_m, variance=0.01):
    """A robot that believes itself so far east, and turned by a tenth of that in rad."""
    one = robot(number, (1.0, 1.0 + number), (0.3, 0.0), goals=(DONE,))
    believed = np.column_stack([one.positions_m[:, :2], np.zeros(len(one.times_s))])
    covariances = np.tile(np.diag([variance, 3.0 * variance, 0.0001]), (len(one.times_s), 1, 1))
    covariances[0] = np.nan
    offset = (east_m, 0.0, 0.1 * east_m)
    return replace(one, believed=believed + offset, covariances=covariances)


def localization_of(page):
    return figures_of(page.html)["localization"]


def test_errors_of_robots_that_find_their_places():
    """Half of the errors are 0.02 m and half 0.06 m; two deviations are twice the root of 0.04."""
    page = flight_page(flight(localized(0, 0.02), localized(1, 0.06)))
    assert Parsed(page.html).sections == [*SECTIONS[:4], "localization", *SECTIONS[4:]]
    assert "0.040, 0.060 m" in page.html
    assert "Localization: 0.040 m and 0.004 rad from the truth" in page.html
    curves = {(one["name"], one["yaxis"]): one["y"] for one in localization_of(page)["data"]}
    believed = "2σ as believed"
    assert curves["error", "y"] == pytest.approx([0.02] * 401)
    assert curves["error", "y3"] == pytest.approx([0.06] * 401)
    assert curves["error", "y4"] == pytest.approx([0.006] * 401)
    assert curves[believed, "y"][0] is None
    assert curves[believed, "y"][1:] == pytest.approx([0.4] * 400)
    assert curves[believed, "y2"][1:] == pytest.approx([0.02] * 400)
    assert localization_of(page)["layout"]["yaxis"]["range"] == pytest.approx([0.0, 0.42])
    assert [one.name for one in page.pictures].count("localization") == 1


def test_a_wide_spread_at_the_start_hides_no_error():
    one = localized(0, 0.02)
    one.covariances[1:20] *= 1000.0
    shown = localization_of(flight_page(flight(one)))
    assert shown["layout"]["yaxis"]["range"] == pytest.approx([0.0, 0.42])


def test_only_the_quadcopters_with_the_largest_errors_are_shown():
    page = flight_page(flight(*(localized(k, 0.01 * k) for k in range(9))))
    titles = {one["text"] for one in localization_of(page)["layout"]["annotations"]}
    assert len(titles) == 16
    assert not any("quad0" in title for title in titles)
    assert "The 8 quadcopters with the largest errors are shown." in page.html


def test_without_the_truth_there_are_deviations_alone():
    page = flight_page(flight(replace(localized(0, 0.02), believed=np.zeros((0, 3)))))
    shown = {one["name"] for one in localization_of(page)["data"]}
    assert shown == {"2σ as believed"}
    assert "from the truth" not in page.html
