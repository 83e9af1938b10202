"""Whatever stands in a file of a stranger's, it is used or refused with a reason.

The targets are those of ``make fuzz``. Here they get the files of the corpus, which hold
what was once a fault, and usual documents with one part replaced by something odd.
"""

from __future__ import annotations

import copy
import datetime
import json
import re
import sys
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

FUZZ = Path(__file__).parents[1] / "fuzz"
sys.path.insert(0, str(FUZZ))

import targets  # noqa: E402

CORPUS = sorted(path for path in (FUZZ / "corpus").rglob("*") if path.is_file())
CONFIG = Path(__file__).parents[2] / "config" / "default"
ODD = [None, True, 0, -1, 1e-300, 1e300, -1e300, float("inf"), float("nan"), 10**40, 2**31]
ODD += ["", "x", "1", "$\\frac{", "\x1b[2J", "\ud800", "a" * 5000, "../../etc/passwd", "/dev/zero"]
ODD += ["a\0b", [], [[]], [1], [1, 2, 3, 4], ["a"], {}, {"a": {"b": []}}, [{}]]
ODD_YAML = [*(value for value in ODD if value != "\ud800"), datetime.date(2001, 1, 1), b"\xff"]

quick = settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)


@pytest.mark.parametrize("path", CORPUS, ids=lambda path: f"{path.parent.name}-{path.name}")
def test_corpus(path):
    used = targets.run(path.parent.name, path.read_bytes())
    if path.stem == "usual":
        assert used


def test_every_target_has_a_corpus():
    assert {path.parent.name for path in CORPUS} == set(targets.TARGETS)


def places(tree, above=()):
    """The ways to every part of a document, the whole first."""
    yield above
    if isinstance(tree, (dict, list)):
        for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
            yield from places(value, (*above, key))


@st.composite
def changed(draw, document, odd):
    """The document with one or two parts that are replaced, left out or there twice."""
    tree = copy.deepcopy(document)
    for _ in range(draw(st.integers(1, 2))):
        ways = list(places(tree))
        *above, last = draw(st.sampled_from(ways[1:])) if len(ways) > 1 else (None,)
        if last is None:
            return draw(st.sampled_from(odd))
        parent = tree
        for key in above:
            parent = parent[key]
        how = draw(st.sampled_from(("replace", "replace", "drop", "double")))
        if how == "replace":
            parent[last] = copy.deepcopy(draw(st.sampled_from(odd)))
        elif how == "drop":
            del parent[last]
        elif isinstance(parent, list):
            parent.append(copy.deepcopy(parent[last]))
        else:
            parent[f"{last}x"] = parent[last]
    return tree


def corpus(name):
    return (FUZZ / "corpus" / name).read_text()


def as_yaml(tree):
    return yaml.safe_dump(tree, allow_unicode=True).encode()


YAMLS = [("scene", "scene/usual"), ("map_yaml", "map_yaml/usual"), ("map_yaml", "map_yaml/scene")]


@quick
@given(changed(json.loads(corpus("goals/usual.json")), ODD))
def test_goals(tree):
    targets.run("goals", json.dumps(tree).encode())


@pytest.mark.parametrize("target, name", YAMLS)
def test_scenes_and_maps(target, name):
    @quick
    @given(changed(yaml.safe_load(corpus(f"{name}.yaml")), ODD_YAML))
    def check(tree):
        targets.run(target, as_yaml(tree))

    check()


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["base_local_planner", "costmap_common", "local_costmap", "global_costmap"]
)
def test_parameters(name):
    document = yaml.safe_load((CONFIG / f"{name}_params.yaml").read_text().replace("$(arg i)", "0"))

    @settings(quick, max_examples=40)
    @given(changed(document, ODD_YAML))
    def check(tree):
        targets.run("parameters", as_yaml(tree))

    check()


WORLD_PARTS = """
<model name='a'>|</model>|<link>|</link>|<collision>|</collision>|<geometry>|</geometry>|<box/>
<box><size>1 1 1</size></box>|<pose>1 2</pose>|<pose>nan inf 0 1e300 0 0</pose>|<plane/>
<pose>1 2 .5 0 0 0</pose>|<sphere><radius>-1</radius></sphere>|<include/>|<state>|</state>
<cylinder><radius>1e-300</radius><length>1</length></cylinder>|&amp;|&x;|<!--|<![CDATA[|\0
<include><uri>model://a</uri></include>|<include><uri>fuzz.world</uri></include>
"""


@quick
@given(st.lists(st.sampled_from(re.split(r"[|\n]", WORLD_PARTS.strip())), max_size=30))
def test_worlds(parts):
    targets.run(
        "world", f"<sdf version='1.6'><world name='w'>{''.join(parts)}</world></sdf>".encode()
    )


@quick
@given(st.data())
def test_what_recordings_tell(data):
    texts = map(json.loads, corpus("flight_info/usual.txt").split("\n"))
    lines = [data.draw(changed(text, ODD)) for text in texts]
    targets.run("flight_info", "\n".join(map(json.dumps, lines)).encode())


@quick
@given(st.binary(max_size=400), st.integers(0, 11))
def test_messages_in_recordings(data, topic):
    targets.run("robot_messages", bytes([topic]) + data)


@quick
@given(st.data())
def test_recordings_with_bytes_changed(data):
    content = bytearray((FUZZ / "corpus" / "bag" / "usual.bag").read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    targets.run("bag", bytes(content))


@quick
@given(st.sampled_from([path for path in CORPUS if path.parent.name == "map_image"]), st.data())
def test_images_with_bytes_changed(path, data):
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, min(len(content), 60) - 1))] = data.draw(
            st.integers(0, 255)
        )
    targets.run("map_image", bytes(content))
