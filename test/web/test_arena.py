"""The arena in the page: what a person does in it.

Each test puts an arena of its own over the page, which has the page's connection, so that it can
ask where things are drawn.
"""

from __future__ import annotations

import math

import pytest
from browser import until

MOUNT = """
async () => {
  const path = performance.getEntriesByType("resource").map(({ name }) => name)
    .find((name) => name.endsWith("/arena_view.js"));
  const { View } = await import(path);
  const root = document.createElement("div");
  root.className = "quad-arena";
  root.tabIndex = 0;
  root.style.cssText = "position:fixed;inset:0;z-index:6500";
  document.body.append(root);
  window.heard = [];
  window.arena = new View(root, (name, value) => window.heard.push([name, value]));
  window.arena.apply({ role: "steer", layers: ["goals", "labels"] });
  window.root = root;
}
"""
GOALS = [
    {"source": 0, "x": 2.0, "y": 8.0, "yaw": None},
    {"source": 1, "x": 6.0, "y": 9.0, "yaw": 0.0},
]
TWO_FINGERS = """() => {
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


class Mounted:
    """An arena over the page, whose robots stand still."""

    def __init__(self, page) -> None:
        self.page = page
        page.evaluate(MOUNT)
        until(page, lambda: self.get("arena._isFitted && arena.fleet.robots.length === 2"))
        self.get("arena._link.removeEventListener('frame', arena._onFrame)")
        self.get("arena._readFleet = () => {}")

    def get(self, expression):
        return self.page.evaluate(f"() => {expression}")

    def pixel_of(self, x, y, z=1.0):
        return self.get(f"arena.view.toScreen({x}, {y}, {z})")

    def robot_pixel(self, index):
        return self.pixel_of(
            *self.get(f"(({{ x, y, z }}) => [x, y, z])(arena.fleet.robots[{index}])")
        )

    def place_of(self, px, py):
        return self.get(f"arena.view.toWorld({px}, {py})")

    def heard(self, name):
        return self.get(f"heard.filter(([name]) => name === '{name}').map(([_, value]) => value)")

    def apply(self, **state):
        self.page.evaluate("(state) => arena.apply(state)", state)

    def set_mode(self, mode):
        self.apply(mode=mode)
        until(self.page, lambda: self.get(f"arena.view === arena._views['{mode}']"))

    def drag(self, start, end):
        mouse = self.page.mouse
        mouse.move(*start)
        mouse.down()
        mouse.move((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
        mouse.move(*end)
        mouse.up()


@pytest.fixture
def arena(driver):
    return Mounted(driver.page)


def test_the_view_is_moved_and_robots_are_picked(arena):
    x, y = arena.robot_pixel(1)
    arena.page.mouse.click(x + 8, y - 8)
    arena.page.mouse.click(x + 8, y - 8)  # again: nothing new
    arena.page.mouse.click(x + 60, y + 60)
    assert arena.heard("select") == [1, None]
    before = arena.place_of(300, 300)
    arena.drag((300, 300), (380, 340))
    assert arena.place_of(380, 340) == pytest.approx(before)
    scale = arena.get("arena.view.viewport.scale")
    arena.page.mouse.wheel(0, -200)
    until(arena.page, lambda: arena.get("arena.view.viewport.scale") > 1.2 * scale)
    assert arena.place_of(380, 340) == pytest.approx(before)
    scale = arena.get("arena.view.viewport.scale")
    arena.page.evaluate(TWO_FINGERS)
    assert arena.get("arena.view.viewport.scale") == pytest.approx(2 * scale)
    arena.apply(layers=["local_costmap", "goals"], selected=1)
    asked = arena.get("JSON.stringify(arena._link._wanted)")
    assert asked == '{"layers":["local_costmap"],"robot":1,"every":true}'
    arena.set_mode("3d")
    assert arena.place_of(*arena.pixel_of(2.5, 7.5)) == pytest.approx([2.5, 7.5])
    arena.page.mouse.click(*arena.robot_pixel(0))
    assert arena.heard("select") == [1, None, 0]


def test_a_goal_is_where_the_drag_begins_and_looks_to_where_it_ends(arena):
    for mode in ("2d", "3d"):
        arena.get("heard.length = 0")
        arena.set_mode(mode)
        arena.apply(tool="goal")
        arena.drag(arena.pixel_of(4, 5), arena.pixel_of(4, 7))
        arena.page.mouse.click(*arena.pixel_of(3, 2))
        turned, plain = arena.heard("goal")
        assert [turned["x"], turned["y"]] == pytest.approx([4, 5], abs=0.02)
        assert turned["yaw"] == pytest.approx(math.pi / 2, abs=0.02)
        assert [plain["x"], plain["y"]] == pytest.approx([3, 2], abs=0.02)
        assert plain["yaw"] is None
    arena.page.mouse.move(300, 300)
    arena.page.mouse.down()
    arena.page.keyboard.press("Escape")  # gives up the goal, and leaves the tool
    arena.page.mouse.up()
    assert len(arena.heard("goal")) == 2 and arena.heard("tool") == ["view"]
    arena.apply(role="watch", tool="goal")  # a page that watches has no tools
    arena.drag((300, 300), (320, 300))
    assert len(arena.heard("goal")) == 2


def test_goals_are_dragged_turned_added_deleted_and_put_in_another_order(arena):
    arena.apply(tool="edit", editing={"robot": 0, "goals": GOALS, "faults": ["", ""]})
    arena.drag(arena.pixel_of(2, 8), arena.pixel_of(3, 6))
    (goals,) = arena.heard("edit")
    assert [goals[0]["x"], goals[0]["y"]] == pytest.approx([3, 6], abs=0.02)
    assert goals[0]["source"] == 0 and goals[1] == GOALS[1]
    x, y = arena.pixel_of(6, 9)
    arena.drag((x + 40, y), (x, y - 70))  # the yaw handle, to north
    assert arena.heard("edit")[-1][1]["yaw"] == pytest.approx(math.pi / 2, abs=0.02)
    arena.page.mouse.click(*arena.pixel_of(9, 3))
    added = arena.heard("edit")[-1][2]
    assert [added["x"], added["y"]] == pytest.approx([9, 3], abs=0.02)
    assert added["source"] is None and added["yaw"] is None
    arena.page.mouse.click(*arena.pixel_of(6, 9), button="right")
    arena.page.click("body > .quad-arena .quad-menu >> text=Earlier")
    assert [goal["source"] for goal in arena.heard("edit")[-1]] == [1, 0, None]
    arena.page.mouse.click(*arena.pixel_of(6, 9))
    arena.page.focus("body > .quad-arena")
    arena.page.keyboard.press("ArrowUp")
    assert [arena.heard("edit")[-1][0][axis] for axis in "xy"] == [6.0, 9.1]
    arena.page.keyboard.press("Delete")
    assert [goal["source"] for goal in arena.heard("edit")[-1]] == [0, None]


def test_a_hidden_page_goes_on_without_drawing_and_without_webgl_there_is_the_map(arena):
    arena.page.evaluate(
        """() => {
          const { getContext } = HTMLCanvasElement.prototype;
          HTMLCanvasElement.prototype.getContext = function (kind, options) {
            return kind === "2d" ? getContext.call(this, kind, options) : null;
          };
        }"""
    )
    arena.apply(mode="3d")
    until(arena.page, lambda: arena.heard("mode") == ["2d"])
    assert "no WebGL" in arena.page.locator("body > .quad-arena .quad-note").text_content()
    arena.page.evaluate(
        """() => {
          Object.defineProperty(document, "hidden", { get: () => true });
          window.counts = { drawn: 0, heard: 0 };
          arena.view.draw = () => { counts.drawn += 1; };
          arena._link.addEventListener("frame", () => { counts.heard += 1; arena._draw(); });
        }"""
    )
    until(arena.page, lambda: arena.get("counts.heard") > 5)
    assert arena.get("counts.drawn") == 0
