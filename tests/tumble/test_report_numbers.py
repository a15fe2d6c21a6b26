"""What a report's page is made of: residuals between outlines, packed numbers, the body that is shown, tables."""

import base64
import csv
import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from datasets.estimate import Estimate, FrameReport, Status
from datasets.vocabulary.body import Body
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.outlines.result import FrameOutline, FrameStatus, OutlineTrack
from tumble.reports.body_shape import MOST_FACES, body_shape
from tumble.reports.csv_tables import TABLES, csv_text
from tumble.reports.packed import FINE, packed, packed_points
from tumble.reports.payload import sequence_parts
from tumble.reports.pictures import Window
from tumble.reports.record import Record
from tumble.reports.residuals import outline_residuals

SURE = np.zeros(0, dtype=bool)
BALL = Body(np.array([0.0, 0.0, 0.001]), np.eye(3), np.ones(3))


def circle(radius: float, *, points: int = 400, off: float = 0.0) -> np.ndarray:
    angle = 2.0 * np.pi * np.arange(points) / points
    return np.column_stack([50.0 + off + radius * np.cos(angle), 40.0 + radius * np.sin(angle)])


def unpacked(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype="<i2").astype(float)


@pytest.mark.parametrize("radius", [20.3, 19.6])
def test_what_is_seen_outside_has_a_positive_residual(radius: float) -> None:
    found = outline_residuals(circle(radius), circle(20.0, points=3000), SURE)
    assert found is not None
    np.testing.assert_allclose(found.distance_px, radius - 20.0, atol=1e-3)
    size = abs(radius - 20.0)
    assert (found.mean_px, found.rms_px, found.largest_px) == pytest.approx((radius - 20.0, size, size), abs=1e-3)
    np.testing.assert_allclose(np.linalg.norm(found.seen_px - found.nearest_px, axis=1), np.abs(found.distance_px), atol=1e-9)


def test_residuals_of_an_outline_that_is_off_follow_its_direction() -> None:
    found = outline_residuals(circle(20.0, off=0.5), circle(20.0, points=3000), SURE)
    assert found is not None
    np.testing.assert_allclose(found.distance_px, 0.5 * (found.nearest_px[:, 0] - 50.0) / 20.0, atol=0.01)


def test_points_that_are_not_the_particles_have_no_residual() -> None:
    seen = circle(20.0)
    seen[:100] += 7.0
    found = outline_residuals(seen, circle(20.0, points=3000), np.arange(400) < 100)
    assert found is not None
    assert found.largest_px < 1e-3
    assert outline_residuals(seen, np.zeros((0, 2)), SURE) is None


def test_points_are_packed_within_a_hundredth_of_a_pixel() -> None:
    window, points = Window(10, -5, 90), circle(30.0)
    back = unpacked(packed_points(points, window)).reshape(-1, 2) * 90 / FINE + [10, -5]
    np.testing.assert_allclose(back, points, atol=0.006)
    assert unpacked(packed(np.array([1e6, -1e6]))).tolist() == [32767.0, -32767.0]


def test_a_fine_hull_is_shown_with_few_faces_and_keeps_its_size() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.002)
    hull = SurfaceMesh(np.asarray(ball.vertices) + BALL.com_particle, np.asarray(ball.faces, dtype=np.int64))
    shown = body_shape(hull, BALL, called="visual hull of the views")
    vertices, faces = unpacked(shown["vertices"]).reshape(-1, 3) * shown["step_mm"], unpacked(shown["faces"]).reshape(-1, 3).astype(int)
    assert len(faces) <= MOST_FACES
    solid = trimesh.Trimesh(vertices, faces)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(4.0 / 3.0 * np.pi * 2.0**3, rel=0.03)
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 2.0, atol=0.03)


def record() -> Record:
    frames = (FrameReport(0, 0, True, "", 0.25, 1.0), FrameReport(0, 1, False, "absent", float("nan"), float("nan")))
    estimate = Estimate("a, b", Status.AMBIGUOUS, 'it said "no"', frames=frames)
    nothing = FrameOutline(Outline(np.zeros((0, 2))), FrameStatus.ABSENT)
    seen = OutlineTrack((FrameOutline(Outline(circle(20.5)), FrameStatus.USED), nothing))
    return Record(estimate, outlines_px=((circle(20.0, points=3000), None),), tracks=(seen,), read=(("x.json", "ab" * 32),))


def test_every_number_is_in_the_tables() -> None:
    parts = sequence_parts(record(), most_frames=8)
    tables = {name: list(csv.DictReader(io.StringIO(csv_text(name, parts["csv"][name])))) for name in TABLES}
    (row,) = tables["sequences"]
    assert (row["sequence"], row["message"], row["frames_used"], row["frames"]) == ("a, b", 'it said "no"', "1", "2")
    assert float(row["rms_residual_px"]) == pytest.approx(0.5, abs=1e-3)
    first, second = tables["frames"]
    assert float(first["residual_mean_px"]) == pytest.approx(0.5, abs=1e-3)
    assert (second["used"], second["reason"], second["residual_rms_px"], second["rms_ete_px"]) == ("False", "absent", "", "")
    assert tables["files_read"] == [{"sequence": "a, b", "file": "x.json", "sha256": "ab" * 32}]


def test_two_particles_in_one_picture_have_no_residuals() -> None:
    one = record()
    both = replace(one, estimate=replace(one.estimate, companion=one.estimate))
    assert one.residuals(0, 0) is not None
    assert both.residuals(0, 0) is None
