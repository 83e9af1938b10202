"""The command that compares on any folder: what it says and its exit status."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest
from families import DATA
from families.comparison import Comparison, Difference
from run import run


def put(folder, family, original, name, **changed):
    """A recorded case under another name, with some arrays changed."""
    target = folder / family
    target.mkdir(exist_ok=True)
    with np.load(DATA / family / f"{original}.npz") as file:
        arrays = {**file, **changed}
    np.savez(target / f"{name}.npz", **{k: v for k, v in arrays.items() if v is not None})
    index = target / "index.json"
    entries = json.loads(index.read_text()) if index.exists() else []
    index.write_text(json.dumps([*entries, {"case": name, "note": "a test's own"}]))


def rows(output):
    """family -> the words of its row."""
    return {words[0]: words[1:] for words in map(str.split, output.splitlines()) if words}


@pytest.fixture
def occupancy_costs():
    with np.load(DATA / "occupancy" / "cost_to_occupancy.npz") as file:
        return file["occupancy"]


def test_unseen_cases_that_agree(tmp_path, capsys):
    put(tmp_path, "occupancy", "cost_to_occupancy", "some name")
    put(tmp_path, "occupancy", "footprint_00", "another")
    put(tmp_path, "inflation", "inf_03", "x")
    assert run(tmp_path) == 0
    output = capsys.readouterr().out
    assert rows(output)["occupancy"] == ["2", "2"]
    assert rows(output)["inflation"] == ["1", "1"]
    assert rows(output)["navfn"] == ["-", "-", "not", "in", "this", "folder"]
    assert output.endswith("\n3 of 3 cases agree.\n")


def test_first_failure_with_case_field_and_difference(tmp_path, capsys, occupancy_costs):
    wrong = occupancy_costs.copy()
    wrong[7] += 1
    wrong[9] += 1
    put(tmp_path, "occupancy", "cost_to_occupancy", "good")
    put(tmp_path, "occupancy", "cost_to_occupancy", "bad", occupancy=wrong)
    put(tmp_path, "occupancy", "cost_to_occupancy", "worse", occupancy=wrong[:5])
    assert run(tmp_path) == 1
    output = capsys.readouterr().out
    assert rows(output)["occupancy"][:7] == ["3", "1", "bad", "occupancy", "2", "of", "256"]
    text = " ".join(output.split())
    assert f"the first at [7]: {occupancy_costs[7]}, recorded {occupancy_costs[7] + 1}" in text
    assert "worse" not in output


def test_unknown_families_are_counted_and_named(tmp_path, capsys):
    put(tmp_path, "occupancy", "cost_to_occupancy", "case")
    put(tmp_path, "occupancy", "footprint_00", "another")
    shutil.copytree(tmp_path / "occupancy", tmp_path / "teb")
    shutil.copytree(tmp_path / "occupancy", tmp_path / "mpc")
    (tmp_path / "mpc" / "index.json").unlink()
    (tmp_path / "notes").mkdir()
    assert run(tmp_path) == 1
    output, errors = capsys.readouterr()
    for family in ("teb", "mpc"):
        assert rows(output)[family] == ["2", "-", "unknown", "family,", "not", "compared"]
        assert f"not compared: {tmp_path / family}: unknown family (2 cases)\n" in errors
    assert "notes" not in rows(output)
    assert output.endswith("\n2 of 6 cases agree, 4 were not compared.\n")


@pytest.mark.parametrize(
    "spoil, said",
    [
        (lambda family: (family / "index.json").unlink(), "index.json: cannot be read"),
        (lambda family: (family / "index.json").write_text("[1]"), "expected a list of {case: "),
        (lambda family: (family / "index.json").write_text("[]"), "there is no case in it"),
        (lambda family: (family / "case.npz").unlink(), "case.npz: the index names it, and there"),
        (lambda family: (family / "case.npz").write_text("?"), "case.npz: cannot be read"),
        (
            lambda family: (family / "case.npz").rename(family / "stray.npz"),
            "stray.npz: the index does not name it",
        ),
        (
            lambda family: put(
                family.parent, "occupancy", "cost_to_occupancy", "case", occupancy=None
            ),
            "case.npz: there is no 'occupancy'",
        ),
    ],
)
def test_what_cannot_be_compared_is_named_and_the_rest_is_compared(tmp_path, capsys, spoil, said):
    put(tmp_path, "occupancy", "cost_to_occupancy", "case")
    put(tmp_path, "inflation", "inf_03", "x")
    spoil(tmp_path / "occupancy")
    assert run(tmp_path) == 1
    output, errors = capsys.readouterr()
    assert "not compared: " in errors and said in errors
    assert "\n1 of " in output and "were not compared.\n" in output


def test_arrays_that_nothing_compares_are_named(tmp_path, capsys):
    put(tmp_path, "static", "static_00", "case", tomorrow_000=np.zeros(3))
    assert run(tmp_path) == 1
    assert "case.npz: nothing compares tomorrow_000" in capsys.readouterr().err


def test_no_folder_and_no_recordings(tmp_path, capsys):
    assert run(tmp_path / "nowhere") == 2
    assert "no such folder" in capsys.readouterr().err
    assert run(tmp_path) == 2
    assert "there are no recordings in it" in capsys.readouterr().err


@pytest.mark.parametrize(
    "found, recorded, text",
    [
        (3, 4, "3, recorded 4"),
        ([1, 2, 3], [1, 5, 6], "2 of 3 differ, the first at [1]: 2, recorded 5"),
        ([[0.0, np.nan]], [[0.0, 1.0]], "1 of 2 differ, the first at [0, 1]: nan, recorded 1.0"),
        (np.zeros((2, 3)), np.zeros((2, 4)), "shape (2, 3), recorded (2, 4)"),
    ],
)
def test_exact(found, recorded, text):
    comparison = Comparison()
    comparison.exact("field", found, recorded)
    assert comparison.differences == [Difference("field", text)]


@pytest.mark.parametrize(
    "found, recorded, text",
    [
        ([1.0, 2.0], [1.0, 2.25], "0.25 apart at [1]: 2.0, recorded 2.25, allowed are 0.1"),
        ([np.nan], [1.0], "inf apart at [0]: nan, recorded 1.0, allowed are 0.1"),
        (np.zeros((0, 2)), np.zeros((1, 2)), "shape (0, 2), recorded (1, 2)"),
    ],
)
def test_near(found, recorded, text):
    comparison = Comparison()
    comparison.near("field", found, recorded, 0.1)
    assert comparison.differences == [Difference("field", text)]
