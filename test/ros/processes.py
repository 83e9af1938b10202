"""What /proc says of processes; one that has ended meanwhile has nothing."""

from pathlib import Path


def read(path):
    """The text of a file, or "" without it."""
    try:
        return Path(path).read_text()
    except (FileNotFoundError, ProcessLookupError):
        return ""


def descendants(pid):
    """Numbers of the processes that a process has started, and of those that these have."""
    found = []
    for child in read(f"/proc/{pid}/task/{pid}/children").split():
        found += [int(child), *descendants(int(child))]
    return found


def words(pid):
    """The command line of a process."""
    return read(f"/proc/{pid}/cmdline").split("\0")


def runs(pid):
    """Whether a process is there and is no zombie."""
    stat = read(f"/proc/{pid}/stat")
    return bool(stat) and stat.rsplit(")", 1)[1].split()[0] != "Z"
