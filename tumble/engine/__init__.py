"""The one engine: runs one task over many items, here, in local processes or on a Dask scheduler, so that no item can lose another.

A task is a picklable function from a plain dict to a plain dict. It writes its own product under a temporary name and renames it; the
engine then marks it as done. Results are the same to the last bit whatever runs them.
"""

from tumble.engine.items import Item, Outcome, State, Task, failures
from tumble.engine.local import Processes, Serial
from tumble.engine.running import Executor, run
from tumble.engine.scheduler import Scheduler

__all__ = ["Executor", "Item", "Outcome", "Processes", "Scheduler", "Serial", "State", "Task", "failures", "run"]
