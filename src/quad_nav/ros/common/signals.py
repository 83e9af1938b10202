"""A node that can be stopped at any moment."""

from __future__ import annotations

import signal
import threading

import rospy


def init_node(name: str) -> None:
    """``rospy.init_node``, with Ctrl-C and SIGTERM shutting down from another thread.

    rospy's own handler closes the publishers in the thread that it interrupts, and
    waits for ever when that thread was publishing and holds the lock.
    """
    rospy.init_node(name, disable_signals=True)

    def shut_down(number, _frame):
        reason = signal.Signals(number).name
        threading.Thread(target=rospy.signal_shutdown, args=(reason,), daemon=True).start()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, shut_down)
