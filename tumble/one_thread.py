"""One thread per process: libraries that start threads of their own are told not to.

Results are bit-identical only at one thread, and local processes already fill the cores. The variables are read when
the libraries are loaded, so this comes before importing them.
"""

from collections.abc import MutableMapping

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def keep_to_one_thread(environment: MutableMapping[str, str]) -> None:
    """Set every thread variable that is not set yet to one."""
    for name in THREAD_VARIABLES:
        environment.setdefault(name, "1")
