"""What the panels of one open page share: its role, its selection, and how actions are called.

Every action of every panel goes through ``PageClient.call``: there the role is checked, in the
server and whatever the browser sends, the action runs in a thread, and its answer is shown and put
into the log of events.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
from typing import Any, Callable, List, Mapping, Optional

from quad_nav.errors import printable
from quad_web.view.actions import LABELS, READS, Actions, Answer, Role
from quad_web.view.state import FleetState

WATCHES = "this page may only watch; open it with the steering address to steer"
NOT_HERE = "not possible here"
_WORKERS = 8

# A node that does not answer keeps a thread for seconds. Stopping has threads of its own, so that
# it never waits for others.
_workers = concurrent.futures.ThreadPoolExecutor(_WORKERS, "page-action")
_stoppers = concurrent.futures.ThreadPoolExecutor(2, "page-stop")


class PageClient:
    """One open page.

    Attributes:
        state: What is shown.
        role: Whether the person may steer.
        selected: Number of the selected robot, None for none.
    """

    def __init__(
        self,
        state: FleetState,
        actions: Actions,
        role: Role,
        show: Callable[[Answer], None] = lambda answer: None,
    ) -> None:
        """Select no robot; ``show`` gets the answer of each action, in the page's event loop."""
        self.state = state
        self.role = role
        self.selected: Optional[int] = None
        self._actions = actions
        self._show = show
        self._listeners: List[Callable[[Optional[int]], None]] = []

    # -- actions ---------------------------------------------------------------------

    def refusal(self, name: str) -> str:
        """Return why this page cannot call an action, "" if it can."""
        if self.role is not Role.STEER:
            return WATCHES
        return "" if name in LABELS and name in self._actions.available else NOT_HERE

    async def call(
        self, name: str, *args: Any, robot: Optional[int] = None, is_quiet: bool = False
    ) -> Answer:
        """Call an action in a thread, and show and log what came of it.

        Args:
            name: One of ``LABELS``.
            *args: Its arguments.
            robot: The robot that the entry in the log is of, None for the whole fleet.
            is_quiet: Show and log only a refusal, for actions that come many in a second.
        """
        refusal = self.refusal(name)
        if refusal:
            answer = Answer(False, f"{LABELS.get(name, name)}: {refusal}")
            self._show(answer)
            return answer
        pool = _stoppers if name == "stop_all" else _workers
        loop = asyncio.get_running_loop()
        answer = await loop.run_in_executor(pool, self._actions.call, name, *args)
        if not (is_quiet and answer.ok):
            level = "info" if answer.ok else "warning"
            text = answer.text if answer.ok else f"{LABELS[name]} failed: {answer.text}"
            self.state.add_event(self.time_s, text, level, robot)
            self._show(answer)
        return answer

    async def read(self, name: str, *args: Any) -> Any:
        """Return what one of ``READS`` returns; it runs in a thread."""
        if name not in READS:
            raise ValueError(f"{name}: expected one of {', '.join(READS)}")
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(_workers, self._actions.call, name, *args)

    def show(self, answer: Answer) -> None:
        """Show an answer without an entry in the log, such as a fault in what was typed."""
        self._show(answer)

    # -- selection -------------------------------------------------------------------

    def select(self, robot: Optional[int]) -> None:
        """Select a robot, or none; listeners are called if that is a change.

        A browser may send anything: what is no number selects none.
        """
        if not isinstance(robot, int):
            robot = None
        if robot == self.selected:
            return
        self.selected = robot
        for listener in self._listeners:
            listener(robot)

    def on_select(self, listener: Callable[[Optional[int]], None]) -> None:
        """Call ``listener`` with the robot's number whenever the selection changes."""
        self._listeners.append(listener)

    # -- what panels read ------------------------------------------------------------

    def data(self, key: str) -> Mapping[str, Any]:
        """Return the data of an item, empty if there is no such item."""
        item = self.state.item(key)
        return item.data or {} if item else {}

    @property
    def time_s(self) -> float:
        """Time on the flight's clock, 0 before the first data."""
        return float(self.data("flight").get("time_s") or 0.0)

    def rows(self) -> List[Mapping[str, Any]]:
        """Return the rows of the item ``status``."""
        return list(self.data("status").get("rows", ()))

    def row(self, robot: Optional[int]) -> Optional[Mapping[str, Any]]:
        """Return a robot's row, None without one."""
        return next((row for row in self.rows() if row["robot"] == robot), None)

    @property
    def has_localization(self) -> bool:
        """Whether a localization runs."""
        return any(row.get("localization") for row in self.rows())

    def name(self, robot: Optional[int]) -> str:
        """Return a robot's name."""
        names = self.data("robots").get("names", ())
        is_known = robot is not None and 0 <= robot < len(names)
        return printable(names[robot]) if is_known else f"quad{robot}"

    def colour(self, robot: Optional[int]) -> str:
        """Return a robot's colour, as CSS."""
        colours = self.data("robots").get("colours", ())
        is_known = robot is not None and 0 <= robot < len(colours)
        return str(colours[robot]) if is_known else "#808080"
