"""Test modules share what they make up: each may import the others by their names."""

import sys
from pathlib import Path

TESTS = Path(__file__).parent
sys.path += [str(folder) for folder in sorted(TESTS.glob("quad_*/**/")) if folder.is_dir()]
# Our messages, as `make workspace` has generated them; only modules with rospy import them.
sys.path.append(str(TESTS.parent / ".ws" / "devel" / "lib" / "python3" / "dist-packages"))
