"""What a particle file keeps gives the same numbers as making it on the way, and counts only for what it was made from."""

import ast
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import CalibratedView
from datasets.recipes.recipe import ParticleRecipe, Recipe, RigRecipe
from datasets.vocabulary.outline import Outline
from estimator.data.configuration import Configuration
from estimator.geometry.outline_bias import noise_streams
from estimator.particle import particle as particle_module
from estimator.particle.made_once import MAKERS, VOCABULARY, MadeOnce, arrays_of, digest_of, made_of_arrays
from estimator.particle.particle import LEAST_HOLLOW, Particle, particle_of
from synth.sequence import plan_sequence, view_outlines

SMALL = Configuration(hull_resolution=32, directions=50)
Given = tuple[tuple[Outline, ...], tuple[CalibratedView, ...]]


@dataclass(frozen=True)
class Kept:
    of: str
    arrays: Mapping[str, NDArray[np.generic]]

    def load(self, of: str) -> Mapping[str, NDArray[np.generic]] | None:
        return self.arrays if of == self.of else None


@pytest.fixture(scope="module", params=["cut_stone", "jagged"])
def given(request: pytest.FixtureRequest) -> Given:
    recipe = Recipe(seed=3, particle=ParticleRecipe(family=request.param, irregularity=0.8, size_mm=(6.0, 6.0)), rig=RigRecipe(drops=2))
    plan = plan_sequence(recipe, 0)
    return view_outlines(plan, recipe.noise, np.random.default_rng(1)), plan.views


@pytest.fixture(scope="module")
def made(given: Given) -> Particle:
    return particle_of(*given, SMALL)


def same(a: Particle, b: Particle) -> None:
    for x, y in zip(arrays_of(a.once(SMALL)).items(), arrays_of(b.once(SMALL)).items(), strict=True):
        assert x[0] == y[0]
        np.testing.assert_array_equal(x[1], y[1])
    for part in vars(a.body):
        np.testing.assert_array_equal(getattr(a.body, part), getattr(b.body, part))
        assert getattr(a.body, part).strides == getattr(b.body, part).strides
    np.testing.assert_array_equal(a.casting_mesh.ends, b.casting_mesh.ends)


def test_what_is_kept_is_what_would_be_made(given: Given, made: Particle) -> None:
    kept = Kept(digest_of(*given, SMALL), arrays_of(made.once(SMALL)))
    again = particle_of(*given, SMALL, kept)
    assert again.made.hull is not None
    assert (again.made.exact_hull is not None) == (made.hollow > LEAST_HOLLOW)
    same(made, again)


def test_a_particle_with_a_file_makes_nothing_of_its_views_again(given: Given, made: Particle, monkeypatch: pytest.MonkeyPatch) -> None:
    """A second sequence's time: silhouettes, mass properties and the bias of the views are read, and are those that would be made."""
    rng = np.random.default_rng(SMALL.seed)
    of_views, _ = noise_streams(rng)
    wanted = made.bias_of_views(pairs=SMALL.bias_pairs, rng=of_views)
    kept = Kept(digest_of(*given, SMALL), arrays_of(made.once(SMALL)))
    for name in ("silhouettes", "agreed_hull", "body_of", "start_catalogue", "largest_moment_per_mass", "bias_under", "cast_convex"):
        monkeypatch.setattr(particle_module, name, None)
    again = particle_of(*given, SMALL, kept)
    of_views, _ = noise_streams(np.random.default_rng(SMALL.seed))
    found = again.bias_of_views(pairs=SMALL.bias_pairs, rng=of_views)
    np.testing.assert_array_equal(found.curves, wanted.curves)
    np.testing.assert_array_equal(again.seen.xy, made.seen.xy)
    assert again.largest_moment_per_mass == made.largest_moment_per_mass


def test_the_bias_of_views_is_kept_for_its_own_draws_alone(given: Given, made: Particle) -> None:
    again = particle_of(*given, SMALL, Kept(digest_of(*given, SMALL), arrays_of(made.once(SMALL))))
    for pairs, seed in ((SMALL.bias_pairs, SMALL.seed + 1), (SMALL.bias_pairs + 1, SMALL.seed)):
        kept, fresh = (one.bias_of_views(pairs=pairs, rng=np.random.default_rng(seed)) for one in (again, made))
        assert kept.of == fresh.of != again.made.view_bias.of  # type: ignore[union-attr]
        np.testing.assert_array_equal(kept.curves, fresh.curves)


def test_another_outline_view_or_setting_is_another_digest(given: Given) -> None:
    outlines, views = given
    first = digest_of(outlines, views, SMALL)
    moved = [Outline(outlines[0].points_px + 1e-12), *outlines[1:]]
    turned = [replace(views[0], t_cam_particle=views[0].t_cam_particle + 1e-12), *views[1:]]
    assert (
        len({first, digest_of(moved, views, SMALL), digest_of(outlines, turned, SMALL), digest_of(outlines, views, Configuration())}) == 4
    )
    assert digest_of(outlines, views, replace(SMALL, pose_starts=99)) == first
    assert replace(particle_of(outlines, turned, SMALL, Kept(first, {})).made, silhouettes=None) == MadeOnce()


def test_arrays_of_something_else_are_refused(made: Particle) -> None:
    arrays = arrays_of(made.once(SMALL))
    with pytest.raises(InputError, match="here: expected the arrays that tumble shape makes"):
        made_of_arrays({"hollow": np.array([0.0])}, "here")
    with pytest.raises(InputError, match="offsets that are not theirs"):
        made_of_arrays({**arrays, "silhouettes_offsets": np.array([0, 10**6])}, "here")
    with pytest.raises(InputError, match="vertices that are not there"):
        made_of_arrays({**arrays, "hull_faces": np.array([[0, 1, 10**6]])}, "here")


WITHOUT_NUMBERS = {
    *("estimator.data.configuration", "estimator.data.fit_task", "estimator.data.no_measurement", "estimator.data.views"),
    "estimator.poses.pose_refinement",
    *("datasets.errors", "datasets.estimate", "datasets.observation"),
}
"""Settings, which count themselves; records and messages; refinement of poses, of which starts only use the record."""


def test_the_digest_covers_the_code_that_its_makers_use() -> None:
    """Else what was made by another version would be taken for the same: a lens, for one, is in ``datasets.vocabulary``."""
    root = Path(__file__).parents[3]
    covered = [root / "estimator" / name for name in MAKERS] + [root / "datasets" / VOCABULARY]
    sources = [file for place in covered for file in (place.glob("*.py") if place.is_dir() else [place])]
    nodes = [node for file in sources for node in ast.walk(ast.parse(file.read_text("utf-8")))]
    used = {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}
    files = {
        module: root.joinpath(*module.split(".")).with_suffix(".py") for module in used if module.startswith(("estimator.", "datasets."))
    }
    assert [module for module, file in files.items() if file not in sources and module not in WITHOUT_NUMBERS] == []
