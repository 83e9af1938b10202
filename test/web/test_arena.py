"""The arena in the page: what a person does in it, and what it does when the link dies.

Each test puts an arena of its own over the page, which has the page's connection, so that it can
ask where things are drawn.
"""

from __future__ import annotations

import math
import signal

import pytest
from browser import until

from quad_web.arena import _pose

MOUNT = """
async (path) => {
  const { ArenaView } = await import(`${path}/arena_view.js`);
  const root = document.createElement("div");
  root.className = "quad-arena";
  root.tabIndex = 0;
  root.style.cssText = "position:fixed;inset:0;z-index:6500";
  document.body.append(root);
  window.heard = [];
  window.arena = new ArenaView(root, (name, value) => window.heard.push([name, value]));
  window.arena.apply({ role: "steer", layers: ["goals", "labels"] });
  window.root = root;
}
"""
GOALS = [
    {"source": 0, "x": 2.0, "y": 8.0, "yaw": None},
    {"source": 1, "x": 6.0, "y": 9.0, "yaw": 0.0},
]


class Mounted:
    """An arena over the page."""

    def __init__(self, page) -> None:
        self.page = page
        path = page.evaluate(
            "() => performance.getEntriesByType('resource').map(({ name }) => name)"
            ".find((name) => name.endsWith('/arena_view.js')).replace('/arena_view.js', '')"
        )
        page.evaluate(MOUNT, path)
        until(page, self.is_drawn)

    def is_drawn(self):
        return self.get("arena._isFitted && arena.fleet.robots.length === 2")

    def get(self, expression):
        return self.page.evaluate(f"() => {expression}")

    def pixel_of(self, x, y, z=1.0):
        return self.get(f"arena.view.toScreen({x}, {y}, {z})")

    def place_of(self, px, py):
        return self.get(f"arena.view.toWorld({px}, {py})")

    def heard(self, name):
        return self.get(f"heard.filter(([name]) => name === '{name}').map(([_, value]) => value)")

    def apply(self, state):
        self.page.evaluate("(state) => arena.apply(state)", state)

    def drag(self, start, end):
        mouse = self.page.mouse
        mouse.move(*start)
        mouse.down()
        mouse.move((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
        mouse.move(*end)
        mouse.up()

    def edit(self):
        self.apply({"tool": "edit", "editing": {"robot": 0, "goals": GOALS, "faults": ["", ""]}})


@pytest.fixture
def loaded(page):
    """The page, with its arena."""
    page.wait_for_selector("canvas.quad-map")
    page.wait_for_function(
        "() => performance.getEntriesByType('resource').some(({ name }) => "
        "name.endsWith('/arena_view.js'))"
    )
    return page


@pytest.fixture
def arena(loaded):
    mounted = Mounted(loaded)
    mounted.get("arena._link.removeEventListener('frame', arena._onFrame)")  # robots stand still
    return mounted


def robot_pixel(arena, index):
    return arena.get(
        f"(({{ x, y, z }}) => arena.view.toScreen(x, y, z))(arena.fleet.robots[{index}])"
    )


def still(arena):
    """Keep the robots where they are drawn, also when the arena draws again."""
    arena.get("arena._readFleet = () => {}")


def test_a_click_selects_the_robot_that_is_near(arena):
    still(arena)
    x, y = robot_pixel(arena, 1)
    arena.page.mouse.click(x + 8, y - 8)
    arena.page.mouse.click(x + 8, y - 8)  # again: nothing new
    arena.page.mouse.click(x + 60, y + 60)
    assert arena.heard("select") == [1, None]


def test_the_selected_robot_has_the_costmaps(arena):
    asked = "() => JSON.stringify(arena._link._wanted)"
    arena.apply({"layers": ["local_costmap", "goals"], "selected": 1})
    assert arena.page.evaluate(asked) == '{"layers":["local_costmap"],"robot":1,"every":true}'
    until(arena.page, lambda: arena.get("arena._link.store.all('local_costmap').length === 1"))
    assert arena.get("arena._link.store.all('local_costmap')[0].robot") == 1


def test_dragging_moves_the_arena_and_the_wheel_zooms_about_the_pointer(arena):
    before = arena.place_of(300, 300)
    arena.drag((300, 300), (380, 340))
    assert arena.place_of(380, 340) == pytest.approx(before)
    scale = arena.get("arena.view.viewport.scale")
    arena.page.mouse.wheel(0, -200)
    until(arena.page, lambda: arena.get("arena.view.viewport.scale") > 1.2 * scale)
    assert arena.place_of(380, 340) == pytest.approx(before)
    assert arena.heard("select") == []


def test_two_fingers_zoom(arena):
    scale = arena.get("arena.view.viewport.scale")
    arena.page.evaluate(
        """() => {
          const target = root.querySelector(".quad-overlay");
          target.setPointerCapture = () => {};
          const send = (type, pointerId, clientX) => target.dispatchEvent(new PointerEvent(type,
            { pointerId, clientX, clientY: 400, pointerType: "touch", button: 0, bubbles: true }));
          send("pointerdown", 1, 400);
          send("pointerdown", 2, 500);
          send("pointermove", 2, 600);
          send("pointerup", 2, 600);
          send("pointerup", 1, 400);
        }"""
    )
    assert arena.get("arena.view.viewport.scale") == pytest.approx(2 * scale)
    assert arena.heard("select") == []


@pytest.mark.parametrize("mode", ["2d", "3d"])
def test_a_goal_is_where_the_drag_begins_and_looks_to_where_it_ends(arena, mode):
    arena.apply({"mode": mode})
    until(arena.page, lambda: arena.get(f"arena.view === arena._views['{mode}']"))
    arena.apply({"tool": "goal"})
    arena.drag(arena.pixel_of(4, 5), arena.pixel_of(4, 7))
    arena.page.mouse.click(*arena.pixel_of(3, 2))
    turned, plain = arena.heard("goal")
    assert [turned["x"], turned["y"]] == pytest.approx([4, 5], abs=0.02)
    assert turned["yaw"] == pytest.approx(math.pi / 2, abs=0.02)
    assert [plain["x"], plain["y"], plain["yaw"]] == [
        pytest.approx(3, abs=0.02),
        pytest.approx(2, abs=0.02),
        None,
    ]


def test_escape_gives_up_the_goal_and_leaves_the_tool(arena):
    arena.apply({"tool": "goal"})
    arena.page.mouse.move(300, 300)
    arena.page.mouse.down()
    arena.page.keyboard.press("Escape")
    arena.page.mouse.up()
    assert arena.heard("goal") == []
    assert arena.heard("tool") == ["view"]


def test_a_page_that_watches_has_no_tools(arena):
    arena.apply({"role": "watch", "tool": "goal"})
    arena.drag((300, 300), (320, 300))
    assert arena.heard("goal") == []


def test_goals_are_dragged_turned_and_added(arena):
    arena.edit()
    arena.drag(arena.pixel_of(2, 8), arena.pixel_of(3, 6))
    (goals,) = arena.heard("edit")
    assert [goals[0]["x"], goals[0]["y"]] == pytest.approx([3, 6], abs=0.02)
    assert goals[0]["source"] == 0 and goals[1] == GOALS[1]
    x, y = arena.pixel_of(6, 9)
    arena.drag((x + 40, y), (x, y - 70))  # the yaw handle, to north
    assert arena.heard("edit")[1][1]["yaw"] == pytest.approx(math.pi / 2, abs=0.02)
    arena.page.mouse.click(*arena.pixel_of(9, 3))
    added = arena.heard("edit")[2][2]
    assert [added["x"], added["y"]] == pytest.approx([9, 3], abs=0.02)
    assert added["source"] is None and added["yaw"] is None


def test_keys_move_and_delete_the_current_goal(arena):
    arena.edit()
    arena.page.mouse.click(*arena.pixel_of(6, 9))
    arena.page.focus("body > .quad-arena")
    arena.page.keyboard.press("ArrowUp")
    arena.page.keyboard.press("Delete")
    moved, deleted = arena.heard("edit")
    assert [moved[1]["x"], moved[1]["y"]] == [6.0, 9.1]
    assert deleted == [GOALS[0]]


def test_the_menu_of_a_goal_changes_the_order(arena):
    arena.edit()
    arena.page.mouse.click(*arena.pixel_of(6, 9), button="right")
    arena.page.click("body > .quad-arena .quad-menu >> text=Earlier")
    assert [goal["source"] for goal in arena.heard("edit")[0]] == [1, 0]


def test_the_link_that_dies_is_told_and_comes_back(loaded, server):
    notice = loaded.locator(".quad-link-notice")
    until(loaded, lambda: not notice.is_visible())
    server.process.send_signal(signal.SIGSTOP)
    until(loaded, notice.is_visible)
    assert "reconnecting" in notice.text_content()
    assert loaded.evaluate("document.body.classList.contains('quad-link-dead')")
    server.process.send_signal(signal.SIGCONT)
    until(loaded, lambda: not notice.is_visible())
    loaded.watch.forgive("WebSocket|ERR_")


def test_a_hidden_page_goes_on_without_drawing(arena):
    arena.page.evaluate(
        """() => {
          Object.defineProperty(document, "hidden", { get: () => true });
          const { view } = arena;
          window.counts = { drawn: 0, acknowledged: 0 };
          view.draw = () => { counts.drawn += 1; };
          arena._link.addEventListener("frame", () => arena._draw());
          arena._link.addEventListener("drawn", () => { counts.acknowledged += 1; });
        }"""
    )
    until(arena.page, lambda: arena.get("counts.acknowledged") > 5)
    assert arena.get("counts.drawn") == 0


def test_without_webgl_there_is_the_map(arena):
    arena.page.evaluate(
        """() => {
          const { getContext } = HTMLCanvasElement.prototype;
          HTMLCanvasElement.prototype.getContext = function (kind, options) {
            return kind === "2d" ? getContext.call(this, kind, options) : null;
          };
        }"""
    )
    arena.apply({"mode": "3d"})
    until(arena.page, lambda: arena.heard("mode") == ["2d"])
    note = arena.page.locator("body > .quad-arena .quad-note")
    assert "no WebGL" in note.text_content()


def test_the_camera_projects_both_ways(arena):
    arena.apply({"mode": "3d"})
    until(arena.page, lambda: arena.get("arena.view === arena._views['3d']"))
    assert arena.place_of(*arena.pixel_of(2.5, 7.5)) == pytest.approx([2.5, 7.5])
    still(arena)
    arena.page.mouse.click(*robot_pixel(arena, 0))
    assert arena.heard("select") == [0]


@pytest.mark.parametrize(
    "pose", [{"x": math.nan, "y": 0, "yaw": None}, {"x": 1, "y": 2, "yaw": 1e999}]
)
def test_goals_that_are_not_finite_are_refused(pose):
    with pytest.raises(ValueError, match="finite"):
        _pose(pose)
