"""Moving obstacles and tracks in the arena."""

from __future__ import annotations

import pytest
from driver import ARENA, Driver


def colour_at(driver, thing, canvas="quad-map"):
    """Return the colour at the middle of a thing of the arena, [red, green, blue, alpha]."""
    return driver.page.evaluate(
        f"""() => {{
            const {{ view, fleet }} = {ARENA};
            const {{ x, y }} = {thing};
            const [px, py] = view.toScreen(x, y);
            const ratio = window.devicePixelRatio;
            const context = document.querySelector("canvas.{canvas}").getContext("2d");
            return [...context.getImageData(px * ratio, py * ratio, 1, 1).data];
        }}"""
    )


def test_a_cart_a_person_and_what_robots_track_of_them(serve, open_page):
    """The cart goes to and fro at 0.5 m/s along the northern wall, the person on a circle.

    Both robots have a track of the cart, one of the hidden person, and a suspect.
    """
    street = Driver(open_page(serve("--robots", "2", "--obstacles").url)).is_ready()
    street.wait_for_arena("arena.fleet.obstacles.length === 2 && arena.fleet.tracks.length === 6")
    (cart, x_m, y_m), (person, *_) = street.arena(
        "fleet.obstacles.map(({ name, x, y }) => [name, x, y])"
    )
    assert (cart, person, y_m) == ("cart", "person_0", street.arena("fleet.scene.size_m[1]") - 0.5)
    street.wait_for_arena(f"Math.abs(arena.fleet.obstacles[0]?.x - {x_m}) > 0.2")
    rings = street.arena("fleet.tracks.map(({ robot, kind, radius }) => [robot, kind, radius])")
    of_one = [("seen", 0.5), ("hidden", 0.3), ("suspect", 0.4)]
    assert rings == [[i, kind, pytest.approx(radius)] for i in (0, 1) for kind, radius in of_one]
    street.select(1)
    street.wait_for_arena("arena.fleet.tracks.every(({ robot }) => robot === 1)")
    red, green, blue, _ = colour_at(street, "fleet.tracks[2]")
    assert red > green > blue + 50  # yellow
    street.page.evaluate(f"() => {ARENA}.apply({{ layers: [], selected: null }})")
    street.fit()
    street.wait_for_arena("arena.fleet.tracks.length === 0")
    assert colour_at(street, "fleet.obstacles[0]") == [0xCC, 0x5C, 0x33, 255]
    street.page.evaluate(f"() => {ARENA}.apply({{ mode: '3d', layers: ['track'] }})")
    street.wait_for_arena("arena.view._obstacles?._solids.length === 2")
    x_m = street.arena("view._obstacles._solids[0].position.x")
    street.wait_for_arena(f"Math.abs(arena.view._obstacles._solids[0]?.position.x - {x_m}) > 0.2")
    assert street.arena("view._obstacles._solids[1].userData.tip.visible")
    street.wait_for_arena("arena.fleet.tracks.length === 6")
    assert colour_at(street, "fleet.tracks[2]", "quad-overlay")[3] > 0
