"""The rooms of the estimator and of the scripts stay small, and nothing lies between them."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ESTIMATOR, SCRIPTS = ROOT / "estimator", ROOT / "scripts"
MOST_FILES = 15
ROOMS = sorted(path.parent for house in (ESTIMATOR, SCRIPTS) for path in house.rglob("__init__.py"))


def files_of(room: Path) -> list[str]:
    return sorted(path.name for path in room.glob("*.py") if path.name != "__init__.py")


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: str(room.relative_to(ROOT)))
def test_a_room_has_no_more_files_than_can_be_seen_at_once(room: Path) -> None:
    assert len(files_of(room)) <= MOST_FILES


def test_only_the_door_lies_outside_of_the_rooms() -> None:
    assert files_of(ESTIMATOR) == ["measure.py"]
    assert files_of(SCRIPTS) == ["real_campaigns.py"]
