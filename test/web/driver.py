"""What a person does on the page: read, click, and point at places of the arena."""

from __future__ import annotations

import re
from typing import Any, Tuple

from playwright.sync_api import Locator, Page, expect


class Driver:
    """A page, and what a person does on it. Positions are metres in ``map``."""

    def __init__(self, page: Page) -> None:
        self.page = page

    def at(self, testid: str) -> Locator:
        """Return the element with a ``data-testid``."""
        return self.page.get_by_test_id(testid)

    def is_ready(self) -> Driver:
        """Wait until the page shows robots."""
        expect(self.at("robots-row-0")).to_be_visible()
        self.page.wait_for_function(f"() => {ARENA}?.fleet.robots.length > 0")
        return self

    def rows(self) -> Locator:
        """Return the rows of the table of robots."""
        return self.page.locator("[data-testid^=robots-row-]")

    def arena(self, expression: str) -> Any:
        """Return what the arena's view in the browser has."""
        return self.page.evaluate(f"() => {ARENA}.{expression}")

    def wait_for_arena(self, condition: str, timeout_s: float = 15.0) -> None:
        """Wait until the arena's view in the browser, ``arena``, meets a condition."""
        script = f"() => {{ const arena = {ARENA}; return {condition}; }}"
        self.page.wait_for_function(script, timeout=1000.0 * timeout_s)

    def use_goal_tool(self, testid: str = "goal-tool") -> None:
        """Have the next click or drag in the arena send a goal."""
        self.at(testid).click()
        expect(self.page.locator(".quad-hint")).to_be_visible()

    def fit(self) -> None:
        """Show the whole arena, and no longer follow a robot."""
        self.page.locator(".quad-arena").get_by_title(re.compile("whole arena")).click()
        self.page.evaluate(
            "() => new Promise((end) => requestAnimationFrame(() => requestAnimationFrame(end)))"
        )

    def select(self, robot: int) -> None:
        """Select a robot in the table."""
        self.at(f"robots-row-{robot}").click()
        expect(self.at("card-name")).to_contain_text(str(robot))

    def tab_to(self, selector: str) -> None:
        """Press Tab until an element has the focus, which each on the way shows by 2 pixels."""
        for _ in range(_MOST_TABS):
            self.page.keyboard.press("Tab")
            found, edge = self.page.evaluate(FOCUS, selector)
            assert edge in ("2px", None), found
            if found is True:
                return
        raise AssertionError(f"no {selector} within {_MOST_TABS} presses of Tab")

    def fly_by_keyboard(self) -> None:
        """Pause, start, select quad1, send it a goal, stop all and resume; the focus is seen."""
        state, press = self.at("flight-state"), self.page.keyboard.press
        for expected in ("paused", "running"):
            self.tab_to("[data-testid=play]")
            press("Enter")
            expect(state).to_have_text(expected)
        self.tab_to("[data-testid=robots-row-0]")
        press("ArrowDown")
        press("Enter")
        expect(self.at("card-name")).to_have_text("quad1")
        self.tab_to("[data-testid=goal-x]")
        self.page.keyboard.type("8")
        self.tab_to("[data-testid=goal-y]")
        self.page.keyboard.type("1.5")
        press("Enter")
        self.says("(8.00, 1.50)")
        self.tab_to("[data-testid=goal-send]")
        press(".")
        expect(state).to_have_text("stopped")
        self.tab_to("[data-testid=play]")
        press("Enter")
        expect(state).to_have_text("running")
        expect(self.at("robots-row-1")).not_to_contain_text("stopped")

    def pixel(self, x_m: float, y_m: float) -> Tuple[float, float]:
        """Return where on the page a point of the arena is."""
        return tuple(
            self.page.evaluate(
                f"""([x, y]) => {{
                    const box = document.querySelector(".quad-arena").getBoundingClientRect();
                    const [px, py] = {ARENA}.view.toScreen(x, y, 1.0);
                    return [box.left + px, box.top + py];
                }}""",
                [x_m, y_m],
            )
        )

    def robot_pixel(self, robot: int) -> Tuple[float, float]:
        """Return where on the page a robot is drawn."""
        x_m, y_m = self.page.evaluate(
            f"(i) => {{ const r = {ARENA}.fleet.robots[i]; return [r.x, r.y]; }}", robot
        )
        return self.pixel(x_m, y_m)

    def resting_robot_pixel(self, robot: int) -> Tuple[float, float]:
        """Return where on the page a robot is drawn once neither it nor the view moves."""
        place, before = self.robot_pixel(robot), None
        while place != before:
            self.page.evaluate(
                "() => new Promise((done) => setTimeout(() => requestAnimationFrame(done), 300))"
            )
            place, before = self.robot_pixel(robot), place
        return place

    def click_arena(self, x_m: float, y_m: float) -> None:
        """Click a point of the arena."""
        self.page.mouse.click(*self.pixel(x_m, y_m))

    def drag_arena(self, start: Tuple[float, float], end: Tuple[float, float]) -> None:
        """Press the mouse at one point of the arena, and release it at another one."""
        mouse = self.page.mouse
        mouse.move(*self.pixel(*start))
        mouse.down()
        mouse.move(*self.pixel(*end), steps=5)
        mouse.up()

    def says(self, text: str) -> None:
        """Wait until an answer is shown."""
        expect(self.page.locator(".q-notification").filter(has_text=text).first).to_be_visible()


_MOST_TABS = 120
# Whether an element has the focus, else which one has it; and the width of its outline, null
# for a field, which has a border, and outside of the page.
FOCUS = """(selector) => {
  const at = document.activeElement;
  const hasOwn = at === document.body || at.closest(".q-field");
  return [at.matches(selector) || at.outerHTML.slice(0, 200),
    hasOwn ? null : getComputedStyle(at).outlineWidth];
}"""
ARENA = "getElement(document.querySelector('.quad-arena'))?.view"
