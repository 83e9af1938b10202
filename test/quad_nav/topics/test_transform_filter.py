"""Transforms that tf2 would follow into the future, print lines about or abort for are refused."""

from __future__ import annotations

import math

import pytest

from quad_nav.errors import excerpt
from quad_nav.geometry import Pose3D
from quad_nav.topics.transform_filter import MAX_FRAMES, TransformFilter

HERE = Pose3D(1.0, 2.0, 0.5)
S = 10**9


@pytest.fixture
def cleared():
    return []


@pytest.fixture
def accept(cleared):
    transforms = TransformFilter(lambda: cleared.append(True))

    def call(parent, child, stamp_s=100.0, now_s=100.0, pose=HERE, is_static=False):
        return transforms.accept(parent, child, pose, round(stamp_s * S), now_s, is_static)

    return call


def test_the_future_begins_one_second_ahead(accept):
    assert accept("map", "odom0", 101.0)
    with pytest.raises(ValueError, match="'odom0' to 'map': stamped 20.00 s ahead of the clock"):
        accept("map", "odom0", 120.0)
    assert accept("map", "odom0", 100.0)


def test_stamps_for_which_tf2_aborts(accept):
    for stamp_s in (2.0**31, 4294967295.99):
        with pytest.raises(ValueError, match="expected 2147480048 s"):
            accept("map", "odom0", stamp_s, now_s=stamp_s)


@pytest.mark.parametrize(
    "pose, reason",
    [
        (Pose3D(math.nan, 0.0, 0.0), "expected finite coordinates"),
        (Pose3D(0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 1.01)), "quaternion of squared length 1.02"),
        (Pose3D(0.0, 0.0, 0.0, (math.nan, 0.0, 0.0, 1.0)), "quaternion of squared length nan"),
    ],
)
def test_poses_that_are_none(accept, pose, reason):
    with pytest.raises(ValueError, match=reason):
        accept("map", "odom0", pose=pose)


@pytest.mark.parametrize("frame", ["", "/", "//odom", "x" * 201, "a\0b", "a\nb", "\x1b[2J"])
def test_frames_without_a_usable_name(accept, frame):
    for parent, child in ((frame, "odom0"), ("map", frame)):
        with pytest.raises(ValueError, match="expected a name of 1 to 200 characters") as refused:
            accept(parent, child)
        assert len(str(refused.value)) < 400 and str(refused.value).isprintable()


def test_a_leading_slash_is_no_part_of_the_name(accept):
    assert accept("/map", "/odom0")
    with pytest.raises(ValueError, match="leads to itself"):
        accept("/odom0", "odom0")


def test_what_tf2_prints_lines_about(accept):
    """A stamp that it has, TF_REPEATED_DATA, and one before those it keeps, TF_OLD_DATA."""
    assert accept("map", "odom0", 99.0) and accept("map", "odom0", 100.0)
    assert not accept("map", "odom0", 99.0) and not accept("map", "odom0", 100.0)
    assert accept("map", "odom0", 99.5) and accept("map", "odom0", 90.0)
    with pytest.raises(ValueError, match="10.50 s older than the newest one, expected 10 s"):
        accept("map", "odom0", 89.5)


def test_loops_are_refused_while_their_transforms_are_fresh(accept, cleared):
    for now_s in (100.0, 100.5):
        accept("map", "odom0", now_s, now_s)
        accept("odom0", "base_link0", now_s, now_s)
        with pytest.raises(ValueError, match="closes a loop of 3 transforms"):
            accept("base_link0", "map", now_s, now_s)
    assert not cleared


def test_a_loop_that_was_begun_by_a_stray_transform_opens_again(accept, cleared):
    accept("base_link0", "map", 100.0, 100.0)
    accept("odom0", "base_link0", 100.0, 100.0)
    with pytest.raises(ValueError, match="loop"):
        accept("map", "odom0", 100.0, 100.0)
    assert accept("map", "odom0", 101.5, 101.5)
    assert cleared == [True]


def test_moving_frames_do_not_become_static(accept):
    accept("map", "odom0")
    with pytest.raises(ValueError, match="is static, expected one with stamps"):
        accept("map", "odom0", is_static=True)


def test_the_number_of_frames_is_limited(accept):
    for k in range(MAX_FRAMES - 1):
        accept("map", f"frame{k}")
    with pytest.raises(ValueError, match="expected 10000 frames at most"):
        accept("map", "one_more")
    assert accept("map", "frame0", 100.5)


def test_texts_of_messages_are_cut_and_escaped():
    assert excerpt("a\x1b[2J\nb\u202e") == "a\\x1b[2J\\nb\\u202e"
    assert excerpt("x" * 10**6, 5) == "xxxxx ... (1000000 characters)"
    assert excerpt("a\nb", keep="\n") == "a\nb"
