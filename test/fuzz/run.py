"""Call a target with bytes that atheris generates: ``make fuzz TARGET=scene SECONDS=60``.

    run.py TARGET [SECONDS]

Starts with the files of ``corpus/TARGET``, or with a valid message for each topic: the target
``messages`` needs ROS. New inputs go into a temporary folder, so that the corpus stays small. Exits
with status 1 at the first fault and keeps its input.
"""

from __future__ import annotations

import importlib
import sys
import tempfile
from pathlib import Path

import atheris

import quad_nav

SOURCES = Path(quad_nav.__file__).parents[1]
for path in SOURCES.rglob("*.py"):  # numba cannot compile atheris's hooks
    if "import njit" in path.read_text():
        importlib.import_module(".".join(path.relative_to(SOURCES).with_suffix("").parts))
with atheris.instrument_imports(include=["quad_nav", "PIL", "yaml", "rosbags"]):
    from targets import TARGETS, run

    if sys.argv[1:2] == ["messages"]:  # the only one that needs ROS
        import ros_targets

        TARGETS["messages"] = ros_targets.messages


def main() -> None:
    if len(sys.argv) not in (2, 3) or sys.argv[1] not in TARGETS:
        sys.exit(f"expected: run.py TARGET [SECONDS], TARGET one of {', '.join(TARGETS)}")
    name, seconds = sys.argv[1], sys.argv[2] if len(sys.argv) == 3 else "60"
    found = Path(tempfile.mkdtemp(prefix=f"quad-fuzz-{name}-"))
    corpus = Path(__file__).parent / "corpus" / name
    if name == "messages":
        corpus = found / "valid"
        corpus.mkdir()
        ros_targets.write_corpus(corpus)
    print(f"new inputs and faults: {found}", flush=True)
    atheris.Setup(
        [
            sys.argv[0],
            f"-max_total_time={seconds}",
            "-timeout=20",
            "-rss_limit_mb=3000",
            "-max_len=20000",
            f"-artifact_prefix={found}/fault-",
            "-print_final_stats=1",
            str(found),
            str(corpus),
        ],
        lambda data: run(name, data) and None,
    )
    atheris.Fuzz()


if __name__ == "__main__":
    main()
