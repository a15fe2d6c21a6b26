"""The page of the first recording is that of its result, its commands are ones that the program takes, and its files are what they say."""

import importlib
import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from datasets.truth_files import read_truth
from datasets.video import open_video
from scripts.pages.first_recording import IMAGES, PAGE, PICTURES, RESULT, STEPS, page_text
from scripts.pages.first_recording_files import NAME, draw_everything
from scripts.pages.tutorial import Step
from tumble.cli.main import VERBS

MOST_COMMANDS, MOST_SECONDS = 8, 900
"""Commands and minutes at most, from files to a score."""
MOST_BYTES = 600_000


def test_the_page_is_that_of_its_result() -> None:
    result, page = json.loads(RESULT.read_text(encoding="utf-8")), PAGE.read_text(encoding="utf-8")
    assert page_text(result) == page
    assert [step["command"] for step in result.values()] == [step.command for step in STEPS]
    assert len(STEPS) <= MOST_COMMANDS
    assert sum(step["seconds"] for step in result.values()) <= MOST_SECONDS
    assert re.findall(r"(?<![\w.\]])/(?:home|root|tmp|work|usr|Users)/", page) == []
    for target in re.findall(r"\]\(([^)#]+)\)", page):
        assert (PAGE.parent / target).exists(), target
    assert sum((IMAGES / f"{name}.png").stat().st_size for name, *_ in PICTURES) < MOST_BYTES


@pytest.mark.parametrize("step", STEPS, ids=lambda step: step.key)
def test_every_command_is_one_that_the_program_takes(step: Step) -> None:
    verb, *words = shlex.split(step.command)[1:]
    assert verb in dict(VERBS)
    assert importlib.import_module(f"tumble.cli.{verb}").parser().parse_args(words) is not None


def test_the_film_has_the_times_of_the_truth_and_every_camera_its_pictures(tmp_path: Path) -> None:
    draw_everything(tmp_path, placements=1, drops=1, frames=3, seed=1)
    film, truth = open_video(tmp_path / f"{NAME}.cine"), read_truth(tmp_path / "truth" / NAME)
    assert film.header.stamps_s is not None
    middle = np.array(film.header.stamps_s.value) + 0.5 * np.array(film.header.exposure_s.value)
    np.testing.assert_allclose(middle, truth.motion.times_s, atol=1e-9)
    assert np.ptp(film.read(0).astype(float)) > 2000
    assert sorted(path.name for path in (tmp_path / "drops" / "01").iterdir()) == [f"cam{k}.png" for k in range(6)]
    assert len(list((tmp_path / "boards").glob("*/00.png"))) == 7
