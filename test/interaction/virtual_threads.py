"""Threads, locks and sleep on a virtual clock: one thing runs at a time, in a fixed order.

A task is a greenlet. It runs until it waits for a condition or a time, then the next task runs.
When all wait, the clock jumps to the next time that one of them waits for. `VirtualThreads.patch`
puts the classes of this module in the place of `threading`, `queue` and `time` in modules under
test, which run unchanged.
"""

from __future__ import annotations

import collections
import contextlib
import math
import queue
import sys
import threading
import time
import traceback
from types import SimpleNamespace
from unittest import mock

import greenlet

SAME_TIME_S = 1e-9


class Task(greenlet.greenlet):
    """Something that runs on the virtual clock, for a node that may die."""

    def __init__(self, target, node):
        super().__init__(target)
        self.node, self.is_true, self.until_s = node, lambda: True, math.inf


class VirtualThreads:
    """All tasks and their clock.

    Attributes:
        now_s: The virtual clock.
        node: The node whose code runs now; any object with `is_alive`.
        crashes: (node, traceback) of each task that an exception has ended.
    """

    is_patched = False

    def __init__(self):
        self.now_s, self.node = 100.0, None
        self.crashes = []
        self._tasks, self._thread = [], threading.get_ident()

    def start(self, target, node):
        """Run a function as a task of a node, from the next wait of the caller on."""

        def run():
            try:
                target()
            except Exception:
                self.crashes.append((node, traceback.format_exc()))

        self._tasks.append(Task(run, node))
        return self._tasks[-1]

    def wait(self, is_true, timeout_s=math.inf):
        """Let the other tasks run until a condition holds or a time has passed.

        Returns:
            Whether the condition holds.
        """
        if is_true():
            return True
        me, node, until_s = greenlet.getcurrent(), self.node, self.now_s + timeout_s
        if isinstance(me, Task):
            me.is_true, me.until_s = is_true, until_s
            me.parent.switch()
        else:
            self._run(is_true, until_s)
        self.node = node
        if isinstance(me, Task) and not me.node.is_alive:
            raise greenlet.GreenletExit
        return bool(is_true())

    def sleep(self, seconds):
        """Let a time pass; a thread that an earlier test has left sleeps by the real clock."""
        if threading.get_ident() != self._thread:
            time.sleep(seconds)
            return
        self.wait(lambda: False, max(seconds, 0.0))

    def kill(self, node):
        """End the tasks of a node at once; it must not be alive any more."""
        for task in [task for task in self._tasks if task.node is node]:
            self._tasks.remove(task)
            if task is not greenlet.getcurrent():
                task.parent = greenlet.getcurrent()
                task.throw(greenlet.GreenletExit)

    def _run(self, is_true, until_s):
        """Run the other tasks, from the greenlet of the test."""
        while not is_true():
            if any([self._resume(task) for task in list(self._tasks)]):
                continue
            next_s = min([until_s, *(task.until_s for task in self._tasks)])
            assert next_s < math.inf, "every task waits for ever"
            if self.now_s >= until_s - SAME_TIME_S:
                return
            self.now_s = max(self.now_s, next_s)

    def _resume(self, task):
        """Run a task if it is due; return whether it was."""
        if task not in self._tasks or not (
            task.until_s <= self.now_s + SAME_TIME_S or task.is_true()
        ):
            return False
        task.until_s, task.is_true = math.inf, lambda: False
        self.node, task.parent = task.node, greenlet.getcurrent()
        task.switch()
        if task.dead and task in self._tasks:
            self._tasks.remove(task)
        return True

    @contextlib.contextmanager
    def patch(self, *packages):
        """Replace threads, queues and time in the loaded modules of some packages."""
        assert not VirtualThreads.is_patched, "another virtual clock is in use"
        VirtualThreads.is_patched, replacements = True, self._replacements()
        with contextlib.ExitStack() as stack:
            for name, module in list(sys.modules.items()):
                if name.split(".")[0] not in packages:
                    continue
                for attribute, value in list(vars(module).items()):
                    if id(value) in replacements:
                        new = replacements[id(value)]
                        stack.enter_context(mock.patch.object(module, attribute, new))
            stack.callback(setattr, VirtualThreads, "is_patched", False)
            yield

    def _replacements(self):
        """Return what takes the place of modules and classes, by their ids."""
        bound = {
            name: type(name, (kind,), {"threads": self})
            for name, kind in {
                "Thread": Thread,
                "Timer": Timer,
                "Event": Event,
                "Lock": Lock,
                "RLock": RLock,
                "Condition": Condition,
            }.items()
        }
        clock = {name: lambda: self.now_s for name in ("monotonic", "perf_counter", "time")}
        modules = {
            id(threading): SimpleNamespace(**{**vars(threading), **bound}),
            id(time): SimpleNamespace(**{**vars(time), **clock, "sleep": self.sleep}),
            id(queue): SimpleNamespace(
                **{**vars(queue), "Queue": type("Queue", (Queue,), {"threads": self})}
            ),
        }
        classes = {id(getattr(threading, name)): kind for name, kind in bound.items()}
        return {**modules, **classes}


class Thread:
    """`threading.Thread`; it belongs to the node that starts it."""

    threads = None

    def __init__(self, group=None, target=None, name=None, args=(), kwargs=None, daemon=None):
        self._call = (target, args, kwargs or {})
        self._task = None

    def run(self):
        target, args, kwargs = self._call
        target(*args, **kwargs)

    def start(self):
        self._task = self.threads.start(self.run, self.threads.node)

    def is_alive(self):
        return self._task is not None and not self._task.dead

    def join(self, timeout=None):
        self.threads.wait(lambda: not self.is_alive(), math.inf if timeout is None else timeout)


class Timer(Thread):
    """`threading.Timer`."""

    def __init__(self, interval, function, args=None, kwargs=None):
        super().__init__(target=function, args=args or (), kwargs=kwargs)
        self._interval_s = interval

    def run(self):
        self.threads.sleep(self._interval_s)
        super().run()


class Event:
    """`threading.Event`."""

    threads = None

    def __init__(self):
        self._is_set = False

    def is_set(self):
        return self._is_set

    def set(self):
        self._is_set = True

    def clear(self):
        self._is_set = False

    def wait(self, timeout=None):
        return self.threads.wait(self.is_set, math.inf if timeout is None else timeout)


class RLock:
    """`threading.RLock`: the task that has it may take it again."""

    threads = None
    is_reentrant = True

    def __init__(self):
        self._owner, self._depth = None, 0

    def acquire(self, blocking=True, timeout=-1):
        me = greenlet.getcurrent()

        def is_free():
            return self._owner is None or (self.is_reentrant and self._owner is me)

        patience_s = math.inf if blocking and timeout < 0 else timeout if blocking else 0.0
        if not self.threads.wait(is_free, patience_s):
            return False
        self._owner, self._depth = me, self._depth + 1
        return True

    def release(self):
        self._depth -= 1
        if not self._depth:
            self._owner = None

    def locked(self):
        return self._owner is not None

    def __enter__(self):
        return self.acquire()

    def __exit__(self, *_):
        self.release()


class Lock(RLock):
    """`threading.Lock`."""

    is_reentrant = False


class Condition:
    """`threading.Condition`, as far as it is used: every waiting task looks by itself."""

    threads = None

    def __init__(self, lock=None):
        self._lock = lock or type("Own", (RLock,), {"threads": self.threads})()
        self.acquire, self.release = self._lock.acquire, self._lock.release

    def __enter__(self):
        return self._lock.acquire()

    def __exit__(self, *_):
        self._lock.release()

    def notify(self, _=1):
        pass

    notify_all = notifyAll = notify

    def wait_for(self, predicate, timeout=None):
        self._lock.release()
        try:
            return self.threads.wait(predicate, math.inf if timeout is None else timeout)
        finally:
            self._lock.acquire()


class Queue(collections.deque):
    """`queue.Queue` without a limit."""

    threads = None
    put = put_nowait = collections.deque.append

    def empty(self):
        return not self

    def qsize(self):
        return len(self)

    def get(self, block=True, timeout=None):
        patience_s = (math.inf if timeout is None else timeout) if block else 0.0
        if not self.threads.wait(lambda: len(self) > 0, patience_s):
            raise queue.Empty
        return self.popleft()

    def get_nowait(self):
        return self.get(block=False)
