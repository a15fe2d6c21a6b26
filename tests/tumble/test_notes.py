"""What a reader changed is told once for a run."""

import json
from pathlib import Path

import numpy as np
import pytest

import tumble.campaigning
import tumble.estimating
from datasets.errors import InputError
from datasets.estimate import Estimate, Status
from datasets.observation_files import write_observation
from estimator.data.configuration import Configuration
from synth.sequence import build_silhouette_sequence
from tests.tumble.made_up import small_recipe
from tumble.campaigning import prepare
from tumble.engine import Serial
from tumble.estimating import estimate_all


@pytest.fixture
def rounded(tmp_path: Path) -> Path:
    """Two observations whose views' matrices were rounded to five digits."""
    for index in range(2):
        observation = build_silhouette_sequence(small_recipe(sequences=2), index)[0]
        folder = tmp_path / "observations" / observation.name
        write_observation(observation, folder)
        document = json.loads((folder / "observation.json").read_text())
        del document["sha256"]
        for view in document["views"]["cameras"]:
            view["R_cam_particle"] = np.round(view["R_cam_particle"], 5).tolist()
        (folder / "observation.json").write_text(json.dumps(document))
    return tmp_path / "observations"


TOLD = "the nearest rotation is used. The same in 1 more."


def test_estimate_tells_once(rounded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(tumble.estimating, "measure", lambda obs, _configuration: Estimate(obs.name, Status.NO_CONVERGENCE, "not tried"))
    estimate_all(rounded, {}, tmp_path / "out", executor=Serial(), quiet=False)
    said = capsys.readouterr().err
    assert said.count("rows miss orthonormality") == 1
    assert TOLD in said


def test_a_campaign_tells_once(rounded: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def nothing(*_: object, **__: object) -> None:
        raise InputError("not registered here")

    monkeypatch.setattr(tumble.campaigning, "register", nothing)
    with pytest.raises(InputError, match="not registered here"):
        prepare(rounded, Configuration(), (), quiet=False)
    said = capsys.readouterr().err
    assert said.count("rows miss orthonormality") == 1
    assert TOLD in said
