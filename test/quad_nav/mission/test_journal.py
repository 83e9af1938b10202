"""Journal: records that a resumed sequencer reads."""

from __future__ import annotations

import errno
import os

import pytest
from size_limit import size_limit

from quad_nav.errors import InputError
from quad_nav.mission.journal import Journal, encode


def lines(path):
    return path.read_bytes().splitlines()


def journal(path, *records):
    """A journal with these records, as a killed writer leaves it."""
    written = Journal(path)
    written.start({"head": 1})
    for record in records:
        assert written.append(record) == ""
    written.close()
    return path


class FullDisk:
    """os.pwrite on a disk with space for ``room`` bytes."""

    def __init__(self, monkeypatch, room):
        self.room = room
        self._write = os.pwrite
        monkeypatch.setattr(os, "pwrite", self)

    def __call__(self, file, data, offset):
        if self.room == 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        done = self._write(file, data[: self.room], offset)
        self.room -= done
        return done


def test_records_are_in_the_file_at_once_and_read_again(tmp_path):
    path = tmp_path / "folder" / "journal.jsonl"
    kept = Journal(path)
    assert kept.start({"head": 1}) == "" and kept.append({"goal": 2}) == ""
    assert lines(path) == [b'{"head": 1}', b'{"goal": 2}']
    assert Journal(path).resume() == [{"head": 1}, {"goal": 2}]


def test_a_new_journal_discards_the_old_content(tmp_path):
    path = journal(tmp_path / "j", {"goal": 1}, {"goal": 2})
    Journal(path).start({"head": 2})
    assert lines(path) == [b'{"head": 2}']


def test_a_resumed_journal_appends(tmp_path):
    path = journal(tmp_path / "j", {"goal": 1})
    later = Journal(path)
    later.resume()
    later.append({"goal": 2})
    assert lines(path) == [b'{"head": 1}', b'{"goal": 1}', b'{"goal": 2}']


def test_a_missing_journal_has_no_records(tmp_path):
    assert Journal(tmp_path / "none").resume() == []


@pytest.mark.parametrize("torn", [b'{"goal', b'{"goal": 2}', b"\x00\x00\x00"])
def test_an_unfinished_line_is_ignored(tmp_path, torn):
    path = journal(tmp_path / "j", {"goal": 1})
    with path.open("ab") as file:
        file.write(torn)
    later = Journal(path)
    assert later.resume() == [{"head": 1}, {"goal": 1}]
    later.append({"goal": 3})
    assert lines(path) == [b'{"head": 1}', b'{"goal": 1}', b'{"goal": 3}']


@pytest.mark.parametrize(
    "line",
    [
        b"nonsense",
        b"[1, 2]",
        b"\xff\xfe",
        b"",
        b'{"a": NaN}',
        b'{"a": -Infinity}',
        b'{"a": 1e999}',
        b'{"a": ' + b"1" * 21 + b"}",
        b'{"a": ' + b"[" * 100_000 + b"]" * 100_000 + b"}",
        b'{"a": ' * 100_000 + b"1" + b"}" * 100_000,
    ],
    ids=lambda line: line[:12].decode("latin-1"),
)
def test_a_line_that_is_not_a_record_is_named(tmp_path, line):
    path = tmp_path / "j"
    path.write_bytes(b'{"head": 1}\n' + line + b'\n{"goal": 1}\n')
    with pytest.raises(
        InputError, match=r"j:2: is not a record of a journal; expected a JSON object"
    ):
        Journal(path).resume()


def test_a_pipe_is_no_journal_and_nothing_waits_for_it(tmp_path):
    os.mkfifo(tmp_path / "j")
    with pytest.raises(InputError, match="is a pipe; expected a file"):
        Journal(tmp_path / "j").resume()


def test_an_unreadable_journal_is_named(tmp_path):
    with pytest.raises(InputError, match="is a folder; expected a file"):
        Journal(tmp_path).resume()


def test_a_full_disk_is_reported_once_and_the_journal_catches_up(tmp_path, monkeypatch):
    path = journal(tmp_path / "j", {"goal": 1})
    later = Journal(path)
    later.resume()
    disk = FullDisk(monkeypatch, room=5)
    news = later.append({"goal": 2})
    assert news.startswith(
        f"{path}: cannot be written: No space left on device; the flight continues"
    )
    assert later.append({"goal": 3}) == "" and later.flush() == ""
    assert lines(path) == [b'{"head": 1}', b'{"goal": 1}']  # and no unfinished line
    disk.room = 1000
    assert later.flush() == f"{path}: can be written again, nothing is missing"
    assert lines(path)[2:] == [b'{"goal": 2}', b'{"goal": 3}']
    assert later.flush() == "" and later.append({"goal": 4}) == ""
    disk.room = 0
    assert "cannot be written" in later.append({"goal": 5})  # a new failure is reported again


def test_a_file_at_its_size_limit_keeps_whole_lines(tmp_path):
    """The operating system refuses to write in the middle of a line."""
    kept = Journal(tmp_path / "j")
    kept.start({"head": 1})
    with size_limit(20):
        assert "cannot be written: File too large" in kept.append({"goal": 2})
    assert lines(tmp_path / "j") == [b'{"head": 1}']
    assert kept.flush().endswith("nothing is missing")
    assert lines(tmp_path / "j") == [b'{"head": 1}', b'{"goal": 2}']


def test_a_folder_that_cannot_be_created_counts_as_a_full_disk(tmp_path):
    (tmp_path / "file").write_text("")
    kept = Journal(tmp_path / "file" / "j")
    assert "cannot be written: " in kept.start({"head": 1})
    (tmp_path / "file").unlink()
    assert kept.flush().endswith("nothing is missing")
    assert lines(tmp_path / "file" / "j") == [b'{"head": 1}']


def test_two_missions_cannot_share_a_journal(tmp_path):
    first, second = Journal(tmp_path / "j"), Journal(tmp_path / "j")
    first.start({"head": 1})
    assert "another running mission writes it" in second.start({"head": 2})
    first.close()
    assert second.flush().endswith("nothing is missing")
    assert lines(tmp_path / "j") == [b'{"head": 2}']


def test_many_records_take_one_access_to_the_disk(tmp_path, monkeypatch):
    kept, forced = Journal(tmp_path / "j"), []
    monkeypatch.setattr(os, "fsync", forced.append)
    kept.clear()
    assert kept.append_lines([encode({"goal": number}) for number in range(50)]) == ""
    assert len(lines(tmp_path / "j")) == 50 and len(forced) == 1


def test_a_number_that_is_not_finite_is_refused():
    with pytest.raises(ValueError):
        encode({"x_m": float("nan")})
