"""Charts of the body and its trajectory are along the first camera's axes, whatever the world's are; a recording is the right one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.estimate_files import write_estimate
from datasets.observation_files import write_observation
from datasets.vocabulary.clock import Clock
from synth.sequence import build_silhouette_sequence
from tests.tumble.made_up import made_up_estimate
from tests.tumble.small_drops import small_drop
from tumble.cli.main import main
from tumble.reports.payload import sequence_payload
from tumble.reports.record import Record


def test_charts_are_along_the_first_cameras_axes() -> None:
    observation, truth = build_silhouette_sequence(small_drop(frames=3, size_px=160), 0)
    estimate = made_up_estimate(observation, truth)
    plain = sequence_payload(Record(estimate, observation), most_frames=1)
    S, shift = Rotation.from_rotvec([0.3, -1.2, 0.8]).as_matrix(), np.array([0.1, -0.2, 0.3])
    camera = observation.cameras[0]
    assert plain["world"] == "World frame, which is the first camera's."
    motion = estimate.motion
    assert motion is not None
    moved = replace(
        motion,
        x_world=motion.x_world @ S.T + shift,
        q_world_body=(Rotation.from_matrix(S) * Rotation.from_quat(motion.q_world_body)).as_quat(),
        v_world=motion.v_world @ S.T,
        omega_world=motion.omega_world @ S.T,
    )
    turned = replace(camera, R_cam_world=camera.R_cam_world @ S.T, t_cam_world=camera.t_cam_world - camera.R_cam_world @ S.T @ shift)
    other = sequence_payload(Record(replace(estimate, motion=moved), replace(observation, cameras=(turned,))), most_frames=1)
    assert other["world"] == "World frame, which is not the first camera's."
    for key in ("x_mm", "omega"):
        np.testing.assert_allclose(other["trajectory"][key], plain["trajectory"][key], atol=2e-4)
    q, p = (np.array(each["trajectory"]["q"]) for each in (other, plain))
    np.testing.assert_allclose(np.abs(np.sum(q * p, axis=1)), 1.0, atol=2e-4)


def test_a_shorter_recording_of_the_same_name_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    observation, truth = build_silhouette_sequence(small_drop(frames=6, size_px=160), 0)
    estimate = made_up_estimate(observation, truth)
    (tmp_path / "estimates").mkdir()
    write_estimate(estimate, tmp_path / "estimates" / f"{estimate.name}.estimate.json")
    clock = Clock(observation.clock.times_s[:3], observation.clock.exposure_s)
    short = replace(observation, recordings=(tuple(observation.recordings[0])[:3],), clock=clock)  # type: ignore[arg-type]
    write_observation(short, tmp_path / "observations" / short.name)
    words = ["report", str(tmp_path / "estimates"), "--observations", str(tmp_path / "observations"), "--jobs", "1", "-q"]
    assert main([*words, "--out", str(tmp_path / "report")]) == 2
    assert "was estimated from, with frames up to 5 of 1 camera(s), got 3 frames of 1" in capsys.readouterr().err
