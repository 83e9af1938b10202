"""The file that ``make bench`` writes, and the comparison of two of them."""

import json
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

BENCH = Path(__file__).resolve().parents[2] / "bench"
sys.path.insert(0, str(BENCH))

import figures  # noqa: E402
from figures import LARGER, SMALLER, Figure, Figures, change  # noqa: E402


def figure(*values, better=SMALLER, unit="ms"):
    return Figure("plan", unit, better, values)


def written(file, values, name="plan", better=SMALLER, unit="ms", script="navigation"):
    measured = Figures(script)
    measured.add(name, unit, values, better)
    measured.write(file)
    return file


def compared(before, after, *options):
    return CliRunner().invoke(figures.main, [str(before), str(after), *options])


def test_the_spread_is_half_the_range_between_the_quartiles():
    assert figure(5.0, 1.0, 2.0, 4.0, 3.0).median == 3.0
    assert figure(5.0, 1.0, 2.0, 4.0, 3.0).spread == 1.0  # quartiles 2 and 4
    assert figure(7.0).spread == 0.0
    for values in ((), (1.0, float("nan"))):
        with pytest.raises(ValueError, match="plan"):
            figure(*values)


def test_a_change_counts_beyond_both_spreads_together():
    before = figure(9.0, 9.0, 10.0, 11.0, 11.0)  # spread 1
    assert change(before, figure(11.0, 11.0, 12.0, 13.0, 13.0)).verdict == 0  # 2 is not beyond 2
    found = change(before, figure(11.5, 11.5, 12.5, 13.5, 13.5))
    assert (found.percent, found.noise_percent, found.verdict) == (25.0, 20.0, -1)


@pytest.mark.parametrize(
    "before, after, better, verdict",
    [
        (100.0, 105.0, SMALLER, 0),  # the tolerance is 5 %
        (100.0, 105.5, SMALLER, -1),
        (8.0, 10.0, LARGER, 1),
        (10.0, 8.0, LARGER, -1),
        (0.0, 0.0, SMALLER, 0),
        (0.0, 1.0, SMALLER, -1),
    ],
)
def test_verdicts_of_single_values(before, after, better, verdict):
    given = figure(before, better=better), figure(after, better=better)
    assert change(*given).verdict == verdict


def test_scripts_share_a_file(tmp_path):
    file = written(tmp_path / "a.json", [1.0, 2.0, 4.0])
    written(file, [200.0], name="2 robots", better=LARGER, unit="", script="flight")
    written(file, [3.0, 5.0, 7.0])  # in place of the first figures
    content = json.loads(file.read_text())
    assert content["format"] == figures.FORMAT
    assert content["machine"]["cores"] >= 1 and content["machine"]["cpu"]
    assert set(content["versions"]) >= {"quad", "numba", "numpy", "python"}
    (plan,) = content["scripts"]["navigation"]["figures"]
    assert plan.items() >= {"name": "plan", "unit": "ms", "better": "smaller"}.items()
    assert (plan["median"], plan["spread"], plan["values"]) == (5.0, 1.0, [3.0, 5.0, 7.0])
    assert content["scripts"]["flight"]["figures"][0]["better"] == "larger"


def test_a_file_of_another_commit_is_not_added_to(tmp_path, capsys):
    file = written(tmp_path / "a.json", [1.0])
    before = file.read_text().replace('"commit": "', '"commit": "0')
    file.write_text(before)
    with pytest.raises(SystemExit) as ended:
        written(file, [2.0], script="flight")
    assert ended.value.code == 2 and "commit 0" in capsys.readouterr().err
    assert file.read_text() == before


def test_the_comparison_names_what_got_slower(tmp_path):
    before = written(tmp_path / "a.json", [10.0, 10.1, 10.2])
    after = written(tmp_path / "b.json", [13.0, 13.1, 13.2])
    result = compared(before, after)
    assert result.exit_code == 1
    row = next(line for line in result.stdout.splitlines() if line.startswith("navigation: plan"))
    assert row.split()[-5:] == ["10.1", "13.1", "+29.7", "1.0", "SLOWER"]
    assert "1 worse, 0 better, 0 the same" in result.stdout
    assert compared(before, after, "--tolerance", "30").exit_code == 0


def test_the_comparison_ends_with_0_if_nothing_got_slower(tmp_path):
    before = written(tmp_path / "a.json", [300.0], name="memory", unit="MB")
    after = written(tmp_path / "b.json", [200.0], name="memory", unit="MB")
    written(after, [1.0], script="lidar")
    result = compared(before, after)
    assert result.exit_code == 0
    assert "-33.3" in result.stdout and "smaller" in result.stdout
    assert "in one file alone: lidar: plan" in result.stdout
    assert "LARGER" in compared(after, before).stdout


def test_doubtful_comparisons_are_remarked(tmp_path):
    before, after = (written(tmp_path / name, [1.0]) for name in ("a.json", "b.json"))
    content = json.loads(after.read_text())
    content["machine"]["cpu"] = "abacus\x1b[2J"
    content["scripts"]["navigation"]["load_average"] = 100.0
    after.write_text(json.dumps(content))
    result = compared(before, after)
    assert result.exit_code == 0
    assert "not the same machine" in result.stdout and "\x1b" not in result.stdout
    assert "after: navigation began at a load average of 100.0" in result.stdout


@pytest.mark.parametrize(
    "text",
    [
        "",
        '{"format": "other"}',
        json.dumps({"format": figures.FORMAT, "scripts": {"a": {"figures": [{"name": "b"}]}}}),
        json.dumps({"format": figures.FORMAT, "scripts": {}}),
    ],
)
def test_a_file_without_figures_ends_with_2(tmp_path, text):
    good, bad = written(tmp_path / "a.json", [1.0]), tmp_path / "b.json"
    bad.write_text(text)
    assert compared(good, bad).exit_code == 2
    assert compared(tmp_path / "none.json", good).exit_code == 2
