"""Threads of linear algebra, before and after it is loaded."""

import os
import subprocess
import sys

import pytest

PROGRAM = """
import os
{first}
from tumble.one_thread import keep_to_one_thread
keep_to_one_thread(os.environ)
import numpy
from threadpoolctl import threadpool_info
print({{library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}})
"""


@pytest.mark.parametrize("first", ["", "import numpy, scipy.linalg"], ids=["not loaded", "loaded"])
def test_linear_algebra_has_one_thread(first: str) -> None:
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", PROGRAM.format(first=first)], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "{1}"


def test_threads_that_a_user_has_set_are_kept() -> None:
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")} | {"OPENBLAS_NUM_THREADS": "2"}
    program = PROGRAM.format(first="import numpy")
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    assert "1" not in done.stdout or (os.cpu_count() or 1) < 2
