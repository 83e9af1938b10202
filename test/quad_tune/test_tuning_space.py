"""Search spaces: what a file says, what is refused, and what a candidate sets."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from quad_nav.errors import InputError
from quad_tune.space import Dimension, SearchSpace, load_space
from quad_tune.study_input import parameter_faults

ROOT = Path(__file__).resolve().parents[2]
TURN = Dimension("P/max_turn", 0.5, 1.5, follow=(("P/min_turn", -1.0), ("*_costmap/x", 2.0)))
RADIUS = Dimension("*_costmap/radius", 0.4, 1.2)


def write(folder: Path, text: str) -> Path:
    path = folder / "space.yaml"
    path.write_text(text)
    return path


def test_a_file_gives_ranges_choices_and_followers(tmp_path):
    space = load_space(
        write(
            tmp_path,
            """\
a: {range: [0.1, 10], log: true}
b: {range: [3, 20], integer: true}
c: {choices: [5.0, 10.0], follow: {d: -1}}
""",
        )
    )
    assert space.dimensions == (
        Dimension("a", 0.1, 10.0, log=True),
        Dimension("b", 3.0, 20.0, integer=True),
        Dimension("c", choices=(5.0, 10.0), follow=(("d", -1.0),)),
    )


def test_every_fault_of_a_file_is_listed_at_once(tmp_path):
    path = write(
        tmp_path,
        """\
a: {range: [2, 1]}
b: 3
c: {range: [0, 1], log: true}
d: {range: [0.5, 3], integer: true}
e: {choices: [1]}
f: {range: [0, 1], ragne: 2}
g: {range: [0, 1], follow: {global_costmap/h: 1}}
"*_costmap/h": {range: [0, 1]}
""",
    )
    with pytest.raises(InputError) as raised:
        load_space(path)
    assert raised.value.problems == [
        f"{path}: a: range: [2, 1], expected [low, high] with low < high",
        f"{path}: b: 3, expected {{range: [low, high]}} or {{choices: [a, b]}}",
        f"{path}: c: range: [0, 1], expected numbers above 0 with log: true",
        f"{path}: d: range: [0.5, 3], expected whole numbers with integer: true",
        f"{path}: e: choices: [1], expected two values or more",
        f"{path}: f: unknown key ragne; expected choices, follow, integer, log, range",
        f"{path}: *_costmap/h: global_costmap/h is also set by g; expected one entry for it",
    ]


def test_values_have_three_digits_within_the_range():
    wide, narrow = Dimension("a", -200.0, 200.0), Dimension("a", 0.1234, 0.5678)
    values = [0.123456, 123.456, 0.00098765, -2.34567, 0.0]
    assert [wide.rounded(value) for value in values] == [0.123, 123.0, 0.000988, -2.35, 0.0]
    assert (narrow.rounded(0.56775), narrow.rounded(0.12341)) == (0.5678, 0.1234)
    assert Dimension("a", 3, 20, integer=True).rounded(7.6) == 8
    assert Dimension("a", choices=(5.0, 10.0)).nearest(7.0) == 5.0


def test_a_candidate_sets_both_costmaps_and_what_follows():
    space = SearchSpace("s", (TURN, RADIUS))
    assert dict(space.assignments({"P/max_turn": 0.7, "*_costmap/radius": 0.8})) == {
        "P/max_turn": 0.7,
        "P/min_turn": -0.7,
        "global_costmap/x": 1.4,
        "local_costmap/x": 1.4,
        "global_costmap/radius": 0.8,
        "local_costmap/radius": 0.8,
    }
    assert dict(space.assignments({"*_costmap/radius": 0.8})) == {
        "global_costmap/radius": 0.8,
        "local_costmap/radius": 0.8,
    }


def test_what_is_fixed_is_neither_searched_nor_followed():
    space = SearchSpace("s", (TURN, RADIUS))
    assert space.without(["/P/max_turn"]).paths == ("*_costmap/radius",)
    assert space.without(["P/min_turn"]).dimensions[0].follow == (("*_costmap/x", 2.0),)
    assert space.without(["*_costmap/radius"]).paths == ("P/max_turn",)
    # One costmap alone can still be searched in the other.
    assert space.without(["global_costmap/radius"]).paths == ("P/max_turn", "*_costmap/radius")


@pytest.mark.parametrize(
    "base, name", [("default", "default"), ("tutorial", "default"), ("barn", "barn"), ("", "dwa")]
)
def test_every_parameter_of_the_shipped_spaces_counts(tmp_path, base, name):
    folder = ROOT / "config" / base
    if not base:
        folder = tmp_path / "dwa"
        shutil.copytree(ROOT / "config" / "default", folder)
        with (folder / "move_base_params.yaml").open("a") as file:
            file.write("base_local_planner: dwa_local_planner/DWAPlannerROS\n")
    space = load_space(ROOT / "spaces" / f"{name}.yaml")
    for values in space.corners():
        assert parameter_faults(space.assignments(values), folder, "s") == []


def test_parameters_that_do_not_count_are_refused():
    faults = parameter_faults(
        [("DWAPlannerROS/max_vel_x", 0.3), ("TrajectoryPlannerROS/max_vell_x", 0.3)],
        ROOT / "config" / "default",
        "space.yaml",
    )
    assert len(faults) == 2
    assert "DWAPlannerROS" in "".join(faults)
    assert "did you mean max_vel_x?" in "".join(faults)
