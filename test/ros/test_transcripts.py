#!/usr/bin/env python3
"""Each session of test/conformance/transcripts answers as C++ move_base did."""

import subprocess
import sys
import unittest
from pathlib import Path

import rostest

SCRIPT = Path(__file__).resolve().parents[1] / "conformance" / "transcript.py"


class Transcripts(unittest.TestCase):
    def test_every_recorded_answer_is_equal(self):
        # Its navigators have a ROS master of their own, one after the other.
        run = subprocess.run([sys.executable, str(SCRIPT)], stdout=subprocess.PIPE, text=True)
        self.assertEqual(run.returncode, 0, run.stdout)


if __name__ == "__main__":
    rostest.rosrun("quad", "transcripts", Transcripts)
