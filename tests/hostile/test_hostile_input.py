"""No spoiled file ends a reader in anything but numbers or one plain sentence.

100 files for each reader here; 2000 on demand: ``python -m tests.hostile.attack --count 2000`` (see there), or this file with
``TUMBLE_HOSTILE_FILES=2000``.
"""

import os

import pytest

from tests.hostile.attack import Tally, attack
from tests.hostile.readers import READERS

COUNT = int(os.environ.get("TUMBLE_HOSTILE_FILES", "100"))
NAMES = [reader.name for reader in READERS]


@pytest.fixture(scope="module")
def tallies() -> dict[str, Tally]:
    return attack(NAMES, COUNT)


@pytest.mark.parametrize("name", NAMES)
def test_a_spoiled_file_is_read_or_refused(tallies: dict[str, Tally], name: str) -> None:
    found = tallies[name]
    assert found.failures == []
    assert found.read + found.refused == COUNT
