"""Moving obstacles and tracks in the arena."""

from __future__ import annotations

import pytest
from driver import ARENA, Driver

PLACES = "obstacles.map(({ name, x, y }) => [name, x, y])"


@pytest.fixture
def street(serve, open_page):
    """A page of two robots, a cart and a person."""
    return Driver(open_page(serve("--robots", "2", "--obstacles").url)).is_ready()


def colour_at(driver, thing):
    """Return the colour at the middle of a thing of the arena, [red, green, blue, alpha]."""
    return driver.page.evaluate(
        f"""() => {{
            const {{ view, fleet }} = {ARENA};
            const {{ x, y }} = {thing};
            const [px, py] = view.toScreen(x, y);
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
    street.page.evaluate(f"() => {ARENA}.apply({{ layers: [] }})")
    street.wait_for_arena("arena.fleet.tracks.length === 0")
    assert colour_at(street, "fleet.obstacles[0]") == [0xCC, 0x5C, 0x33, 255]
    assert street.arena("fleet.scene.solids.every(({ name }) => name !== 'cart')")


def test_moving_obstacles_are_drawn_in_space(street):
    street.page.evaluate(f"() => {ARENA}.apply({{ mode: '3d' }})")
    street.wait_for_arena("arena.view._obstacles?._solids.length === 2")
    x_m = street.arena("view._obstacles._solids[0].position.x")
    street.wait_for_arena(f"Math.abs(arena.view._obstacles._solids[0].position.x - {x_m}) > 0.2")
    assert street.arena("view._obstacles._solids[1].userData.tip.visible")


def test_what_robots_track_is_drawn_and_can_be_switched_off(street):
    """Both robots have a track of the cart, one of the hidden person, and a suspect."""
    street.wait_for_arena("arena.fleet.tracks.length === 6")
    rings = "tracks.map(({ robot, kind, radius }) => [robot, kind, radius])"
    of_one = [("seen", 0.5), ("hidden", 0.3), ("suspect", 0.4)]
    expected = [[robot, kind, pytest.approx(radius)] for robot in (0, 1) for kind, radius in of_one]
    assert street.arena(f"fleet.{rings}") == expected
    street.select(1)
    street.wait_for_arena("arena.fleet.tracks.every(({ robot }) => robot === 1)")
    red, green, blue, _ = colour_at(street, "fleet.tracks[2]")
    assert red > green > blue + 50  # yellow
    street.page.evaluate(f"() => {ARENA}.apply({{ layers: ['goals'] }})")
    street.wait_for_arena("arena.fleet.tracks.length === 0")
    assert colour_at(street, "({ x: 6.1, y: 1.1 })") == [255, 255, 255, 255]


def test_tracks_are_rings_in_space(street):
    street.page.evaluate(f"() => {ARENA}.apply({{ mode: '3d', layers: ['track'] }})")
    street.wait_for_arena("arena.view._ribbons?._count > 0 && arena.fleet.tracks.length === 6")
    # Rings of 24 sides and the lines ahead of the cart and the person, of two triangles each.
    assert street.arena("view._ribbons._count") == 2 * (3 * 24 + 2) * 6
