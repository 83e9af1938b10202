"""Obstacles that move."""

from __future__ import annotations

import pytest
from driver import ARENA, Driver

PLACES = "obstacles.map(({ name, x, y }) => [name, x, y])"


@pytest.fixture
def street(serve, open_page):
    """A page of two robots, a cart and a person."""
    return Driver(open_page(serve("--robots", "2", "--obstacles").url)).is_ready()


def colour_of_cart(driver):
    """Return the colour at the middle of the cart, [red, green, blue, alpha]."""
    return driver.page.evaluate(
        f"""() => {{
            const {{ view, fleet }} = {ARENA};
            const [px, py] = view.toScreen(fleet.obstacles[0].x, fleet.obstacles[0].y);
            const ratio = window.devicePixelRatio;
            const context = document.querySelector("canvas.quad-map").getContext("2d");
            return [...context.getImageData(px * ratio, py * ratio, 1, 1).data];
        }}"""
    )


def test_moving_obstacles_are_drawn_where_they_are(street):
    """The cart goes to and fro at 0.5 m/s along the northern wall, the person on a circle."""
    street.wait_for_arena("arena.fleet.obstacles.length === 2")
    (cart, x_m, y_m), (person, *_) = street.arena(f"fleet.{PLACES}")
    assert (cart, person) == ("cart", "person_0")
    assert y_m == pytest.approx(street.arena("fleet.scene.size_m[1]") - 0.5)
    street.wait_for_arena(f"Math.abs(arena.fleet.obstacles[0].x - {x_m}) > 0.2")
    assert colour_of_cart(street) == [0xCC, 0x5C, 0x33, 255]
    assert street.arena("fleet.scene.solids.every(({ name }) => name !== 'cart')")


def test_moving_obstacles_are_drawn_in_space(street):
    street.page.evaluate(f"() => {ARENA}.apply({{ mode: '3d' }})")
    street.wait_for_arena("arena.view._obstacles?._solids.length === 2")
    x_m = street.arena("view._obstacles._solids[0].position.x")
    street.wait_for_arena(f"Math.abs(arena.view._obstacles._solids[0].position.x - {x_m}) > 0.2")
    assert street.arena("view._obstacles._solids[1].userData.tip.visible")
