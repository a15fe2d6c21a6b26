"""Drops as they lie on a disk: which picture is of which camera, and what is no new view."""

from pathlib import Path

import cv2
import numpy as np

from datasets.vocabulary.camera import HsvCamera, Intrinsics
from tumble.shaping.drops import Drop, Pictures, drop_of, named_apart


def camera(name: str, number: int) -> HsvCamera:
    return HsvCamera(name, Intrinsics(80, 60, 100.0 + number, 100.0, 39.5, 29.5), np.eye(3), np.array([0.0, 0.0, 1.0]))


def test_pictures_named_as_cameras_are_of_these_however_numbers_sort(tmp_path: Path) -> None:
    """``cam10`` comes before ``cam2`` by letters and after it by numbers."""
    numbers = (1, 2, 10)
    for number in numbers:
        mask = np.zeros((60, 80), np.uint8)
        mask[20:40, 5 * number : 5 * number + 20] = 255
        cv2.imwrite(str(tmp_path / f"cam{number}.png"), mask)
    drop = drop_of(tmp_path, [camera(f"cam{number}", number) for number in numbers], Pictures(masks=True))
    for outline, view in zip(drop.outlines, drop.views, strict=True):
        number = round(view.intrinsics.fx_px - 100.0)
        assert abs(outline.points_px[:, 0].min() - (5 * number - 0.5)) < 1.0


def test_drops_of_one_name_are_told_apart() -> None:
    """``monday/01`` and ``tuesday/01``: tables and notes go by names."""
    drops = [Drop(name, Path(name), (), (), {}) for name in ("01", "02", "01", "01")]
    assert [drop.name for drop in named_apart(drops)] == ["01", "02", "01-2", "01-3"]
