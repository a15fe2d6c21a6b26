"""Manners of local processes that work for this one: they leave Ctrl-C to it, and end when it has ended."""

import multiprocessing
import os
import signal
import threading
from typing import Any


def begin_worker() -> None:
    """Leave Ctrl-C to the parent, and end when the parent has ended, however it did; to be called in the worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: Any) -> None:
    parent.join()
    os._exit(1)


def stop_workers() -> None:
    """End all workers of this process: what they still do is of no use."""
    for worker in multiprocessing.active_children():
        worker.terminate()
