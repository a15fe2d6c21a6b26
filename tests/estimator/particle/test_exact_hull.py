"""The polyhedral visual hull against bodies known in closed form, thin spikes, and views that do not belong together."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
import trimesh
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.geometry.cast_outline import cast_outline, casting_mesh
from estimator.geometry.visual_hull import visual_hull
from estimator.particle.exact_hull import exact_hull
from synth.silhouette.exact_outline import exact_outline, outline_mesh
from tests.estimator.exact import ellipsoid_outlines, rig

Array = NDArray[np.float64]
SEMI_AXES = np.array([3.2e-3, 2.5e-3, 1.9e-3])
SPIKE_M = 2.5e-3


def solid(mesh: SurfaceMesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def spiked() -> trimesh.Trimesh:
    """A ball of 2 mm with a thin needle that stands out of it."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=2e-3)
    needle = trimesh.creation.cone(radius=3e-4, height=2e-3 + SPIKE_M, sections=24)
    return trimesh.boolean.union([ball, needle], engine="manifold")


def test_an_ellipsoid_is_held_closed_and_little_exceeded() -> None:
    views = rig(7)
    mesh = solid(exact_hull(ellipsoid_outlines(SEMI_AXES, views), views, tolerance_px=0.1))
    assert mesh.is_watertight
    true = 4.0 / 3.0 * np.pi * np.prod(SEMI_AXES)
    assert 0.0 < mesh.volume / true - 1.0 < 0.02
    assert np.linalg.norm(mesh.vertices / SEMI_AXES, axis=1).min() > 0.998


def test_it_casts_every_outline_that_it_was_made_of() -> None:
    body, views = spiked(), rig(7)
    mesh = outline_mesh(np.asarray(body.vertices), np.asarray(body.faces))
    exact = [exact_outline(mesh, v.intrinsics, v.R_cam_particle, v.t_cam_particle) for v in views]
    hull = casting_mesh(exact_hull([Outline(o) for o in exact], views, tolerance_px=0.1))
    for outline, view in zip(exact, views, strict=True):
        cast = shapely.Polygon(cast_outline(hull, view.intrinsics, view.R_cam_particle, view.t_cam_particle))
        assert cast.symmetric_difference(shapely.Polygon(outline)).area < 0.005 * cast.area


def test_a_needle_keeps_its_length_and_its_slenderness_where_voxels_lose_them() -> None:
    body, views = spiked(), rig(7)
    mesh = outline_mesh(np.asarray(body.vertices), np.asarray(body.faces))
    outlines = [Outline(exact_outline(mesh, v.intrinsics, v.R_cam_particle, v.t_cam_particle)) for v in views]
    exact = exact_hull(outlines, views, tolerance_px=0.1)
    carved = visual_hull(outlines, views)
    tip = 2e-3 + SPIKE_M
    assert exact.vertices[:, 2].max() == pytest.approx(tip, abs=5e-5)
    assert carved.vertices[:, 2].max() < exact.vertices[:, 2].max()
    # Half a millimetre below its tip the needle's section is a disc of 0.033 mm radius.
    for hull, least, most in ((exact, 0.8, 1.6), (carved, 0.0, 0.8)):
        section = solid(hull).section(plane_origin=(0.0, 0.0, tip - 5e-4), plane_normal=(0.0, 0.0, 1.0))
        area = 0.0 if section is None else section.to_2D()[0].area
        assert least <= area / (np.pi * (3e-4 * 5e-4 / tip) ** 2) <= most


def test_cones_with_nothing_in_common_are_refused() -> None:
    views = rig(1)
    outlines = ellipsoid_outlines(SEMI_AXES, views)
    aside = np.array([1.0, 0.0, 0.0]) * 0.05
    views = [replace(v, t_cam_particle=v.t_cam_particle + (aside if i == 0 else 0.0)) for i, v in enumerate(views)]
    with pytest.raises(InputError, match="in common"):
        exact_hull(outlines, views, tolerance_px=0.1)
