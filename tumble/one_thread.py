"""One thread per process: libraries that start threads of their own are told not to.

Results are bit-identical only at one thread, and local processes already fill the cores. Libraries read the variables when
they are loaded, so this comes best before importing them; those that are loaded already (in a notebook, under a test) are told too.
"""

import sys
from collections.abc import MutableMapping

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def keep_to_one_thread(environment: MutableMapping[str, str]) -> None:
    """Set every thread variable that is not set yet to one, and limit the linear algebra that is loaded already, unless it was set."""
    for name in THREAD_VARIABLES:
        environment.setdefault(name, "1")
    if "numpy" in sys.modules and environment["OPENBLAS_NUM_THREADS"] == "1":
        from threadpoolctl import threadpool_limits  # noqa: PLC0415 - a program that has loaded nothing starts without it

        threadpool_limits(limits=1, user_api="blas")
