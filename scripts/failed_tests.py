#!/usr/bin/env python3
"""failed_tests.py FOLDER: print a line for each failed test of the results in a folder.

The results are JUnit's XML files. Each line has the file, the test, the first line of its message
and the line of code.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Iterator
from xml.etree import ElementTree


def failures(folder: Path) -> Iterator[tuple[str, str, str, str]]:
    """Yield (file, test, first line of the message, line of code) of each failed test."""
    for path in sorted(folder.rglob("*.xml")):
        try:
            cases = list(ElementTree.parse(path).iter("testcase"))
        except ElementTree.ParseError as error:  # of a test that was killed
            yield path.stem, "all", f"no result: {error}", str(path)
            continue
        for case in cases:
            for fault in case.findall("failure") + case.findall("error"):
                lines = (fault.text or fault.get("message") or "no message").strip().splitlines()
                yield path.stem, case.get("name"), lines[0][:300], lines[-1].strip()


for file, test, message, code in failures(Path(sys.argv[1])):
    print(f"quad: failed: {file}: {test}: {message}: {code}")
