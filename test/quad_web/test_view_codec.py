"""Messages to the page: what is encoded is decoded, arrays begin at multiples of 8 bytes."""

from __future__ import annotations

import gc
import json
import struct

import numpy as np
import pytest

from quad_web.view import codec
from quad_web.view.codec import decode, encode
from quad_web.view.state import Item

ARRAYS = {
    "pose": np.arange(6, dtype=np.float32).reshape(2, 3),
    "times": np.array([0.5, np.nan]),
    "costs": np.array([[-1, 0, 100]], np.int8),
    "mask": np.array([0, 255, 7, 9, 1], np.uint8),
    "ids": np.array([-5], np.int32),
    "none": np.zeros((0, 2), np.float32),
}


def test_items_come_back():
    items = [
        Item("a", {"text": "Grüße \u2028"}, ARRAYS),
        Item("b"),
        Item("c", [1], {"x": ARRAYS["pose"]}),
    ]
    header, arrays = decode(encode(items, ["plan/3"], seq=7, wall_s=1.5))
    assert (header["removed"], header["seq"], header["wall_s"]) == (["plan/3"], 7, 1.5)
    assert [(item["key"], item["data"]) for item in header["items"]] == [
        ("a", {"text": "Grüße \u2028"}),
        ("b", None),
        ("c", [1]),
    ]
    for name, array in ARRAYS.items():
        back = arrays["a"][name]
        assert back.dtype == array.dtype
        np.testing.assert_array_equal(back, array)
    assert arrays["c"]["x"].tolist() == [[0, 1, 2], [3, 4, 5]]


def test_message_is_laid_out_as_documented():
    """The mask of 5 bytes is padded to 8, so that the next array begins at 8."""
    message = encode(
        [Item("a", None, {"mask": ARRAYS["mask"]}), Item("b", None, {"ids": ARRAYS["ids"]})]
    )
    (length,) = struct.unpack_from("<I", message)
    assert (4 + length) % 8 == 0
    assert len(message) == 4 + length + 8 + 8
    first, second = json.loads(message[4 : 4 + length])["items"]
    assert first["arrays"] == [
        {"name": "mask", "type": "u1", "shape": [5], "offset": 0, "bytes": 5, "deflated": False}
    ]
    assert second["arrays"][0]["offset"] == 8
    assert message[4 + length :] == b"\x00\xff\x07\x09\x01\0\0\0" + b"\xfb\xff\xff\xff\0\0\0\0"


def test_large_costmaps_are_deflated():
    costs = np.zeros((400, 400), np.int8)
    costs[100:110] = 100
    points = np.zeros((5000, 2), np.float32)
    message = encode([Item("map", None, {"costs": costs, "points": points})])
    header, arrays = decode(message)
    described = {array["name"]: array["deflated"] for array in header["items"][0]["arrays"]}
    assert described == {"costs": True, "points": False}
    assert len(message) < 160_000 / 50 + points.nbytes
    np.testing.assert_array_equal(arrays["map"]["costs"], costs)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_numbers_that_json_lacks_are_refused(value):
    with pytest.raises(ValueError):
        encode([Item("a", {"x": value})])
    with pytest.raises(ValueError):
        encode([], wall_s=value)


def test_unknown_types_are_refused():
    with pytest.raises(ValueError, match="points: type int64; expected one of f4"):
        encode([Item("a", None, {"points": np.zeros(3, np.int64)})])


def test_an_item_is_encoded_once_and_forgotten_with_it(monkeypatch):
    encoded = []
    whole = codec._encoded_array
    monkeypatch.setattr(
        codec, "_encoded_array", lambda name, array: encoded.append(name) or whole(name, array)
    )
    gc.collect()
    before = len(codec._encoded_items)
    item, other = Item("a", None, {"pose": ARRAYS["pose"]}), Item("b", None, {"ids": ARRAYS["ids"]})
    first, second = encode([item, other]), encode([other, item])
    assert encoded == ["pose", "ids"]
    assert decode(first)[1]["a"]["pose"].tolist() == decode(second)[1]["a"]["pose"].tolist()
    assert len(codec._encoded_items) == before + 2
    del item, other
    gc.collect()
    assert len(codec._encoded_items) == before
