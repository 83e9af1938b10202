"""What apt offers decides whether the system packages are installed, not the system's name."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# Of a system whose apt offers what `offers` lists; nothing is installed.
COMMANDS = {
    "id": "echo 0",
    "dpkg": "",
    "dpkg-query": "",
    "apt-get": 'echo "apt-get $*"',
    "apt-cache": """
shift
for name; do
    grep -qx "$name" {folder}/offers && echo "$name:" && echo "  Installed: (none)" &&
        echo "  Candidate: $(sed -n "s/^$name //p" {folder}/versions)" && echo "  Version table:"
done""",
}


@pytest.fixture
def system(tmp_path):
    """Return a function that installs the packages where apt offers some, without a Python."""
    for name, body in COMMANDS.items():
        (tmp_path / name).write_text(
            f"#!{shutil.which('bash')}\n{body.replace('{folder}', str(tmp_path))}\n"
        )
        (tmp_path / name).chmod(0o755)
    for name in ("bash", "dirname", "env", "flock", "grep", "sed"):
        (tmp_path / name).symlink_to(shutil.which(name))
    packages = (ROOT / "scripts" / "packages-debian.txt").read_text(encoding="utf-8").split("\n")
    known = {name for name in packages if name[:1] not in ("", "#")} | {"python3", "rviz"}

    def install(*options, without=(), also=(), python="3.13.5-1"):
        offered = sorted((known | set(also)) - set(without))
        (tmp_path / "offers").write_text("\n".join(offered))
        versions = {name: "1.2" for name in offered}
        versions["python3"] = python
        (tmp_path / "versions").write_text("\n".join(map(" ".join, versions.items())))
        return subprocess.run(
            ["bash", str(ROOT / "scripts" / "install_packages"), *options],
            env={"PATH": str(tmp_path), "QUAD_PYTHON": str(tmp_path / "python3")},
            capture_output=True,
            text=True,
            check=False,
        )

    return install


def test_packages_are_installed_where_apt_has_all_of_them(system):
    done = system("--rviz")
    assert done.returncode == 0
    last = done.stdout.splitlines()[-1]
    assert " install " in last and " python3-rospy " in last and last.endswith(" rviz")


def test_the_icons_of_rviz_with_qt_6_are_installed_where_there_are_some(system):
    done = system("--rviz", also=["qt6-svg-plugins"])
    assert " rviz qt6-svg-plugins" in done.stdout.splitlines()[-1]


def test_what_apt_does_not_have_is_named_and_nothing_is_installed(system):
    done = system(without=["catkin", "python3-rospy"])
    assert done.returncode == 1
    assert done.stderr.startswith("quad: apt does not offer catkin python3-rospy, which Debian ")
    assert "uvx --python 3.13 --from . quad fly" in done.stderr
    assert " install " not in done.stdout


def test_a_browser_that_is_not_offered_is_to_be_installed_by_hand(system):
    done = system("--browser", without=["chromium"])
    assert "or set QUAD_CHROMIUM to" in done.stderr


@pytest.mark.parametrize("python, status", [("3.14.0-1", 1), ("3.13.12-1", 0)])
def test_a_python_that_apt_would_install_is_refused_before(system, python, status):
    done = system(python=python)
    assert done.returncode == status
    assert (" install " in done.stdout) == (status == 0)
    assert ("quad: apt has Python 3.14, expected at most 3.13; " in done.stderr) == (status == 1)
