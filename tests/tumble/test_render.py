"""``tumble render``: resolved configuration, resuming after a kill, refusing two runs, a full disk, jobs that make no difference."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from datasets.dataset_files import read_dataset
from datasets.observation_files import read_observation
from datasets.truth_files import read_truth
from tumble.cli.main import main

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]
SMALL = ["--set", "motion.frames=5", "--set", "rig.drops=1", "-q"]
MANY = ["--set", "sequences=6", *SMALL]


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of the two trees and the dataset's description."""
    roots = ("observations", "truth", "dataset.json")
    files = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.relative_to(folder).parts[0] in roots]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def start(*words: str) -> subprocess.Popen[str]:
    """The program as a terminal starts it; tests that run as a shell's background job would have it ignore Ctrl-C."""
    heeds = "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)"
    program = f"{heeds}; from tumble.cli.main import main; sys.exit(main())"
    return subprocess.Popen([sys.executable, "-c", program, *words], cwd=ROOT, stderr=subprocess.PIPE, text=True)


def wait_for(path: Path, process: subprocess.Popen[str]) -> None:
    while not path.exists():
        assert process.poll() is None, process.communicate()[1]
        time.sleep(0.01)


def test_a_dataset_has_its_two_trees_and_its_configuration(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "d"
    assert main(["render", "--set", "sequences=2", *SMALL, "--json", "--out", str(out)]) == 0
    assert json.loads(capsys.readouterr().out) == {"dataset": str(out), "sequences": 2, "failed": 0}
    names = read_dataset(out).sequences
    assert len(names) == 2
    for name in names:
        observation, truth = read_observation(out / "observations" / name), read_truth(out / "truth" / name)
        assert observation.name == truth.name == name
        assert len(observation.recordings[0]) == 5
        assert truth.bound is not None
        assert truth.bound.time_s == truth.motion.times_s[2]
    run = json.loads((out / "run.json").read_text(encoding="utf-8"))
    assert run["configuration"]["motion"]["frames"] == 5
    assert run["configuration"]["hsv"]["width_px"] == 1024
    assert (run["seed"], run["variant"], run["state"]) == (1, None, "finished")


def test_jobs_make_no_difference(tmp_path: Path) -> None:
    for jobs in ("1", "2"):
        assert main(["render", "--set", "sequences=3", *SMALL, "--jobs", jobs, "--out", str(tmp_path / jobs)]) == 0
    assert contents(tmp_path / "1") == contents(tmp_path / "2")


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_killed_run_is_resumed_with_the_same_result(tmp_path: Path, jobs: str) -> None:
    words = ["render", *MANY, "--jobs", jobs, "--out"]
    process = start(*words, str(tmp_path / "killed"))
    wait_for(tmp_path / "killed" / "finished" / ".0001.json.done", process)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert not (tmp_path / "killed" / "dataset.json").exists()
    stale = tmp_path / "killed" / "finished" / ".0005.json.node-1.partial"
    stale.write_text("{", encoding="utf-8")
    first = (tmp_path / "killed" / "finished" / "0001.json").stat().st_mtime_ns
    assert main([*words, str(tmp_path / "killed"), "--resume"]) == 0
    assert (tmp_path / "killed" / "finished" / "0001.json").stat().st_mtime_ns == first
    assert main([*words, str(tmp_path / "whole")]) == 0
    assert contents(tmp_path / "killed") == contents(tmp_path / "whole")
    assert not stale.exists()


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_ctrl_c_says_how_to_go_on(tmp_path: Path, jobs: str) -> None:
    process = start("render", *MANY, "--jobs", jobs, "--out", str(tmp_path / "d"))
    wait_for(tmp_path / "d" / "finished" / "0000.json", process)
    process.send_signal(signal.SIGINT)
    error = process.communicate(timeout=30)[1]
    assert process.returncode == 130, error
    assert "--resume goes on from here" in error
    assert "Traceback" not in error
    assert json.loads((tmp_path / "d" / "run.json").read_text(encoding="utf-8"))["state"] == "unfinished"


def test_a_second_run_into_one_folder_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    process = start("render", *MANY, "--jobs", "1", "--out", str(tmp_path / "d"))
    wait_for(tmp_path / "d" / "run.json", process)
    assert main(["render", *MANY, "--out", str(tmp_path / "d"), "--force"]) == 2
    assert f"process {process.pid} is writing there" in capsys.readouterr().err
    process.terminate()
    process.communicate()


def test_a_full_disk_is_a_sentence_and_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = os.replace

    def full(source: object, target: object, **options: object) -> None:
        if "-0001" in str(target):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(source, target, **options)  # type: ignore[arg-type]

    words = ["render", "--set", "sequences=2", *SMALL, "--jobs", "1", "--out", str(tmp_path / "d")]
    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", full)
        assert main(words) == 1
    error = capsys.readouterr().err
    assert "the disk is full" in error
    assert "0001 failed" in error
    assert read_dataset(tmp_path / "d").sequences == ("cut_stone-0000",)
    assert list((tmp_path / "d").rglob("*.partial")) == []
    run = json.loads((tmp_path / "d" / "run.json").read_text(encoding="utf-8"))
    assert run["state"] == "finished_with_failures"
    assert [(failure["item"], "the disk is full" in failure["reason"]) for failure in run["failures"]] == [("0001", True)]
    assert main([*words, "--resume"]) == 0
    assert json.loads((tmp_path / "d" / "run.json").read_text(encoding="utf-8"))["state"] == "finished"
    assert len(read_dataset(tmp_path / "d").sequences) == 2


@pytest.mark.parametrize(
    ("setting", "sentence"),
    [
        ("motion.frame=5", 'did you mean "frames"'),
        ("hsv.distance_m=600", "millimetres taken for metres"),
        ("sequences", "key=value"),
    ],
)
def test_a_bad_setting_is_explained(tmp_path: Path, setting: str, sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", "--set", setting, "--out", str(tmp_path / "d")]) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "d").exists()
