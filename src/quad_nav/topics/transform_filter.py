"""Accept or reject incoming transforms before tf2 stores them.

Any node can publish on `/tf`. tf2 itself prints a line for every transform that it ignores, aborts
the process for stamps far in the future, and follows a transform from the future until the clock
has passed it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Callable, Dict, List, Set

from quad_nav.errors import excerpt
from quad_nav.geometry import Pose3D
from quad_nav.topics.validation import frame_problem, pose_problem, stamp_problem

MAX_FRAMES = 10_000
KEPT_S = 10.0
"""Time for which tf2 keeps the transforms of a frame."""
STALE_S = 1.0
"""A transform of a loop that was not repeated for this time makes way for the others."""
_KEPT_NS = int(KEPT_S * 1e9)
_LENGTH_TOLERANCE = 0.01  # of the square of a quaternion's length, as in tf2


@dataclass
class _Edge:
    """Transforms of one child frame.

    Attributes:
        parent: Parent frame of the newest one.
        is_static: Whether it counts for all times.
        received_s: Time at which the newest one arrived.
        stamps_ns: Stamps that tf2 keeps, in order of arrival; values are not used.
        newest_ns: Latest stamp.
    """

    parent: str
    is_static: bool
    received_s: float
    stamps_ns: Dict[int, None] = field(default_factory=dict)
    newest_ns: int = -1

    def is_too_old(self, stamp_ns: int) -> bool:
        return stamp_ns < self.newest_ns - _KEPT_NS

    def add(self, stamp_ns: int, now_s: float) -> None:
        self.received_s = now_s
        self.stamps_ns[stamp_ns] = None
        self.newest_ns = max(stamp_ns, self.newest_ns)
        while self.is_too_old(next(iter(self.stamps_ns))):
            del self.stamps_ns[next(iter(self.stamps_ns))]


class TransformFilter:
    """Judge transforms, one after the other, by those accepted before."""

    def __init__(self, clear: Callable[[], None]) -> None:
        """Start without transforms.

        Args:
            clear: Makes tf2 forget all transforms that are not static.
        """
        self._clear = clear
        self._edges: Dict[str, _Edge] = {}
        self._frames: Set[str] = set()
        self._moving: Set[str] = set()  # tf2 keeps it of a frame, even when its data are cleared

    def clear(self) -> None:
        """Forget the transforms that are not static, after the clock has jumped back."""
        self._edges = {child: edge for child, edge in self._edges.items() if edge.is_static}
        self._clear()

    def accept(
        self,
        parent: str,
        child: str,
        pose: Pose3D,
        stamp_ns: int,
        now_s: float,
        is_static: bool = False,
    ) -> bool:
        """Return whether tf2 stores a transform; False for one that it has already.

        Args:
            parent: Frame in which the pose is.
            child: Frame whose pose it is.
            pose: ``parent_from_child``.
            stamp_ns: Stamp in whole nanoseconds.
            now_s: Present time.
            is_static: Whether the transform came on `/tf_static`.

        Raises:
            ValueError: If the transform cannot be used; says why.
        """
        parent, child = _without_slash(parent), _without_slash(child)
        problem = _transform_problem(pose, stamp_ns, now_s)
        if problem:
            raise ValueError(f"{_pair(parent, child)}: {problem}")
        edge = self._edges.get(child)
        if edge is None or edge.parent != parent:
            self._check_frames(parent, child, now_s)
        if is_static and child in self._moving:
            raise ValueError(f"{_pair(parent, child)} is static, expected one with stamps")
        return self._is_new(parent, child, stamp_ns, now_s, is_static)

    def _is_new(
        self, parent: str, child: str, stamp_ns: int, now_s: float, is_static: bool
    ) -> bool:
        edge = self._edges.get(child)
        if edge is None:
            edge = self._edges[child] = _Edge(parent, is_static, now_s)
            if not is_static:
                self._moving.add(child)
        if edge.is_too_old(stamp_ns):
            age_s = (edge.newest_ns - stamp_ns) * 1e-9
            raise ValueError(
                f"{_pair(parent, child)} is {age_s:.2f} s older than the newest one, expected"
                f" {KEPT_S:g} s at most"
            )
        if stamp_ns in edge.stamps_ns and not edge.is_static:
            return False
        edge.parent = parent
        if not edge.is_static:
            edge.add(stamp_ns, now_s)
        return True

    def _check_frames(self, parent: str, child: str, now_s: float) -> None:
        for frame in (parent, child):
            problem = frame_problem(frame)
            if problem:
                raise ValueError(problem)
        if parent == child:
            raise ValueError(f"{_pair(parent, child)} leads to itself")
        new = {parent, child} - self._frames
        if len(self._frames) + len(new) > MAX_FRAMES:
            raise ValueError(f"{_pair(parent, child)} is new, expected {MAX_FRAMES} frames at most")
        loop = self._loop(parent, child)
        if any(not one.is_static and abs(now_s - one.received_s) > STALE_S for one in loop):
            self.clear()
        elif loop:
            raise ValueError(f"{_pair(parent, child)} closes a loop of {len(loop) + 1} transforms")
        self._frames |= new

    def _loop(self, parent: str, child: str) -> List[_Edge]:
        """Return the transforms that lead from a parent to its child, [] if none do."""
        passed: List[_Edge] = []
        frame = parent
        while frame != child:
            edge = self._edges.get(frame)
            if edge is None:
                return []
            passed.append(edge)
            frame = edge.parent
        return passed


def _transform_problem(pose: Pose3D, stamp_ns: int, now_s: float) -> str:
    x, y, z, w = pose.quaternion
    square = x * x + y * y + z * z + w * w
    if not abs(square - 1.0) <= _LENGTH_TOLERANCE:
        return f"quaternion of squared length {square:g}, expected 1"
    return pose_problem(pose) or stamp_problem(stamp_ns * 1e-9, now_s)


def _without_slash(frame: str) -> str:
    """Return a frame as tf2 stores it."""
    return frame[1:] if frame.startswith("/") else frame


def _pair(parent: str, child: str) -> str:
    return f"transform from '{excerpt(child)}' to '{excerpt(parent)}'"
