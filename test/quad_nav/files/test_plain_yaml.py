"""YAML that looks small and is large, and values that do not fit their types."""

from __future__ import annotations

import pytest
import yaml

from quad_nav.files import plain_yaml
from quad_nav.files.plain_yaml import MAX_LEVELS, MAX_NODES, load


def refusal(text):
    with pytest.raises(yaml.YAMLError) as caught:
        load(text)
    return str(caught.value)


def bomb(open_, close, lines):
    """Return YAML in which each line refers nine times to the line before."""
    text = f"a0: &a0 {open_}x{close}\n"
    for k in range(lines):
        text += f"a{k + 1}: &a{k + 1} [{','.join([f'*a{k}'] * 9)}]\n"
    return text


def test_aliases_may_refer_to_earlier_anchors():
    assert load("a: &a [1, 2]\nb: *a\nc: {<<: &d {x: 1}, y: 2}\ne: *d") == {
        "a": [1, 2],
        "b": [1, 2],
        "c": {"x": 1, "y": 2},
        "e": {"x": 1},
    }


def test_aliases_count_as_often_as_they_are_used():
    assert len(load(bomb("[", "]", 4))) == 5  # 9^4 is 6561
    assert f"more than {MAX_NODES} values" in refusal(bomb("[", "]", 9))


def test_merges_count_too():
    text = "a0: &a0 {x: 1}\n" + "".join(
        f"a{k + 1}: &a{k + 1} {{<<: [{','.join([f'*a{k}'] * 9)}]}}\n" for k in range(9)
    )
    assert f"more than {MAX_NODES} values" in refusal(text)


@pytest.mark.parametrize("text", ["&a [*a]", "&a {b: *a}", "a: &a {<<: *a}", "&a [[[*a]]]"])
def test_an_alias_inside_its_own_anchor_is_refused(text):
    assert "an alias stands in what it stands for" in refusal(text)


def test_levels(monkeypatch):
    inside = MAX_LEVELS - 1
    assert load("[" * inside + "1" + "]" * inside)
    expected = f"more than {MAX_LEVELS} levels inside each other"
    assert expected in refusal("[" * MAX_LEVELS + "1" + "]" * MAX_LEVELS)
    assert expected in refusal("[" * 100_000)
    chain = "a0: &a0 [1]\n" + "".join(f"a{k}: &a{k} [*a{k - 1}]\n" for k in range(1, 80))
    assert expected in refusal(chain)


def test_too_many_values_are_refused_without_reading_on(monkeypatch):
    monkeypatch.setattr(plain_yaml, "MAX_NODES", 100)
    # The text ends within a list: what comes after the limit is not even looked at.
    assert "more than 100 values" in refusal("a: [" + "1, " * 200 + "{")


BAD = ["!!int x", "!!int ''", "!!float x", "!!bool z", "!!timestamp t", "2001-99-99", "0x_", "0b_"]
BAD += ["? !!set {a}\n: 1", "!!python/object/apply:os.system [x]", "9" * 5000, "!!omap 3"]
BAD += ["!!pairs [3]"]


@pytest.mark.parametrize("text", BAD)
def test_values_that_do_not_fit_their_type_are_faults_with_a_place(text):
    assert "line 1" in refusal(text)
