"""Outlines of physically rendered pictures against the exact projection of the mesh."""

import numpy as np
import pytest

from datasets.observation_files import read_observation
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RenderingRecipe, RigRecipe
from datasets.truth_files import read_truth
from estimator.outlines import outlines_of
from synth.plan import particle_poses_in_camera
from synth.rendering.sequence import render_sequence
from synth.silhouette import exact_outline, outline_mesh

LIMITS = {"matte": (0.02, 0.12, 0.04), "rough_metal": (0.05, 0.15, 0.065), "diamond": (0.4, 0.8, 0.2)}
"""Per material: bias (px), spread (px) and bias of the tangent points (px).

Metal reflects the light at its rim, so that its outlines lie inside. Its tangents are off by -0.061 px; by -0.050, with a limit of 0.06,
while chords were imaged, whose error lay outside where edges are most curved and hid a part (means of all points: -0.038 and -0.035).
"""


@pytest.fixture(scope="module", params=LIMITS)
def rendered(request, tmp_path_factory):
    recipe = Recipe(
        seed=5,
        tier="rendered",
        particle=ParticleRecipe(material=request.param),
        motion=MotionRecipe(frames=2, speed_ms=(0.5, 2.0)),
        rig=RigRecipe(drops=1, rendered=False),
        rendering=RenderingRecipe(variant="scalar_rgb", samples_per_subframe=4),
    )
    out = tmp_path_factory.mktemp("rendered")
    name = render_sequence(recipe, 0, out)
    return request.param, read_observation(out / "observations" / name), read_truth(out / "truth" / name)


def test_bias_and_spread(rendered, darkroom):
    material, observation, truth = rendered
    camera = observation.cameras[0]
    track = outlines_of(observation.recordings[0], camera.intrinsics)
    mesh = outline_mesh(truth.mesh_vertices, truth.mesh_faces)
    R, t = particle_poses_in_camera(truth.body, truth.motion, camera)
    exact = [exact_outline(mesh, camera.intrinsics, R[i], t[i]) for i in range(len(R))]
    assert track.used.all()
    distance = np.concatenate([darkroom.signed_distances(o.points_px, e) for o, e in zip(track.outlines, exact, strict=True)])
    support = np.concatenate([darkroom.support_difference(o.points_px, e) for o, e in zip(track.outlines, exact, strict=True)])
    bias, spread, tangents = LIMITS[material]
    assert abs(distance.mean()) < bias
    assert distance.std() < spread
    assert abs(support.mean()) < tangents
