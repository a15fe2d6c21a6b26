"""The challenge on pictures: every effect reaches them, and a campaign of pictures is made, solved and scored as one of outlines is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from datasets.observation import Frames, Observation
from datasets.observation_files import read_observation
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, RenderingRecipe, RigRecipe
from datasets.truth_files import read_truth
from datasets.vocabulary.effects import PICTURED
from synth.plan import SequencePlan
from synth.rendering.shots import Shot, frame_shots, hsv_optics, view_shots
from synth.rendering.variant import available_variants
from synth.sequence import plan_sequence
from tumble.challenge.cases import Case, read_cases
from tumble.challenge.drawing import RENDERED, Plan, Shape, draw_case
from tumble.challenge.limits import TABLE, read_table
from tumble.challenge.making import make_campaigns
from tumble.cli import main as command_line
from tumble.engine import Serial, State

SHAPE = Shape(sequences=2, frames=8, views=12, rendered=True)
PLAN = Plan(SHAPE, *RENDERED, read_table(TABLE))


def drawn(*keys: str) -> Case:
    """A case whose seed is the same whatever is hidden."""
    kind = "single" if keys else "control"
    case = draw_case(PLAN, (kind, keys), "c001", np.random.default_rng([5150, 1]))
    particle = ParticleRecipe(size_mm=(4.0, 4.5), irregularity=0.6)
    rendering = RenderingRecipe(subframes=1, rig_samples=9)
    small = {"motion": MotionRecipe(frames=SHAPE.frames, speed_ms=(1.0, 2.0)), "rig": RigRecipe(drops=2, mm_per_px=0.05)}
    return replace(case, recipe=replace(case.recipe, seed=3, particle=particle, rendering=rendering, **small))


def planned(case: Case) -> tuple[SequencePlan, list[Shot], list[Shot]]:
    plan = plan_sequence(case.recipe, 1)
    return plan, list(frame_shots(plan, case.recipe, 1)), list(view_shots(plan, case.recipe, 1))


@pytest.fixture(scope="module", name="plain")
def plain_plan() -> tuple[SequencePlan, list[Shot], list[Shot]]:
    return planned(drawn())


@pytest.mark.parametrize("key", PICTURED)
def test_every_effect_reaches_the_pictures(key: str, plain: tuple[SequencePlan, list[Shot], list[Shot]]) -> None:
    """By what is rendered (poses, cameras, rows, blur), by what is done to a picture, or by how light becomes numbers."""
    case = drawn(key)
    if key == "dropped_frames":
        (effect,) = case.recipe.effects
        case = replace(case, recipe=replace(case.recipe, effects=(replace(effect, values={"count": 2.0, "after_frame": 3.0}),)))
    plan, frames, views = planned(case)
    effects = plan.effects
    shown = [(seen(shot), shot.blur_px) for shot in frames] != [(seen(shot), shot.blur_px) for shot in plain[1]]
    lens = hsv_optics(plan, case.recipe).intrinsics != hsv_optics(plain[0], case.recipe).intrinsics
    shapes = not np.array_equal(plan.vertices, plain[0].vertices)
    assert shown or lens or shapes or effects.redraws_frames or effects.redraws_views or effects.level is not None
    assert [seen(shot) for shot in views] == [seen(shot) for shot in plain[2]]


def seen(shot: Shot) -> tuple[object, ...]:
    poses = [part.poses for part in shot.strips] or [shot.poses]
    return shot.cameras, len(shot.strips), tuple((R.tobytes(), t.tobytes()) for part in poses for R, t in part)


@pytest.fixture(scope="module", name="made")
def made_campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not any(variant.works for variant in available_variants()):
        pytest.skip("no variant of Mitsuba works here")
    root = tmp_path_factory.mktemp("rendered")
    (outcome,) = make_campaigns([drawn("outline_offset")], root / "made", executor=Serial(), quiet=True)
    assert outcome.state is State.DONE
    return root


def observations(made: Path) -> list[Observation]:
    return [read_observation(made / "made" / "campaigns" / "c001" / "observations" / f"c001-{i}") for i in (1, 2)]


def test_observations_are_pictures_of_one_particle_and_truth_is_apart(made: Path) -> None:
    first, second = observations(made)
    for each in (first, second):
        assert isinstance(each.recordings[0], Frames)
        assert isinstance(each.view_recording, Frames)
        assert len(each.recordings[0]) == SHAPE.frames
    np.testing.assert_array_equal(first.view_recording.read(7), second.view_recording.read(7))
    assert not np.array_equal(first.recordings[0].read(0), second.recordings[0].read(0))
    (case,) = read_cases(made / "made")
    assert case.keys == ("outline_offset",)
    assert read_truth(made / "made" / "truth" / "c001" / "c001-1").masks is None
    assert [path.name for path in (made / "made" / "truth" / "c001").iterdir() if path.name.startswith(".")] == [".case.json.done"]


def test_pictures_are_solved_and_scored_apart(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--jobs", "1", "-q"]
    assert command_line.main(["challenge", "solve", str(made / "made"), "--out", str(made / "answers"), *words]) == 0
    score = ["challenge", "score", str(made / "made"), str(made / "answers"), "--out", str(made / "score"), "--no-oracle", "--jobs", "1"]
    assert command_line.main(score) == 0
    printed = capsys.readouterr().out.splitlines()
    assert {line[0] for line in printed} == {"6", "7"}
    row = pd.read_csv(made / "score" / "cases.csv").iloc[0]
    assert (row["tier"], row["hidden"], row["left_out"]) == ("rendered", "outline_offset", 0)
