"""The engine on a Dask scheduler: the same results, one lost item at most, other software refused, a scheduler that comes back."""

import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from datasets.errors import InputError, TumbleError
from datasets.observation_files import write_observation
from datasets.recipes.recipe import MotionRecipe, Recipe, RigRecipe
from synth.sequence import build_silhouette_sequence
from tests.tumble import tasks
from tests.tumble.test_engine import items, kill_first, outcomes_of
from tests.tumble.test_render import start, wait_for
from tumble.cli.main import main
from tumble.engine import Processes, Scheduler, Serial, State, scheduler
from tumble.engine.build import build, refuse_other_build
from tumble.engine.items import job_of
from tumble.estimating import estimate_all

pytest.importorskip("distributed")
ROOT = Path(__file__).resolve().parents[2]


class Programs:
    """A scheduler and a worker, started by Dask's own commands."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = str(free.getsockname()[1])
        self.address, self.folder = f"tcp://127.0.0.1:{self.port}", folder
        self.begin()

    def begin(self) -> None:
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", self.port)
        self.worker = self._start("worker", self.address, "--nthreads", "1", "--local-directory", str(self.folder))

    def _start(self, what: str, *words: str) -> "subprocess.Popen[bytes]":
        program = f"from distributed.cli.dask_{what} import main; main()"
        command = [sys.executable, "-W", "ignore", "-c", program, "--no-dashboard", *words]
        return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def end(self) -> None:
        for program in (self.worker, self.scheduler):
            program.terminate()
            program.wait()


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The scheduler file of two local workers, which `tumble cluster` starts and a signal ends."""
    folder = tmp_path_factory.mktemp("cluster")
    place = folder / "scheduler.json"
    (folder / "cluster.toml").write_text('system = "local"\nworkers = 2\n', encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT", "3s")  # for results of workers that died, which Dask asks for 30 s
        process = start("cluster", str(folder / "cluster.toml"), "--scheduler-file", str(place))
    try:
        wait_for(place, process)
        yield str(place)
    finally:
        process.terminate()
        said = process.communicate(timeout=30)[1]
    assert process.returncode == 0, said
    assert not place.exists()
    assert "2 workers asked for" in said
    assert "Traceback" not in said


def test_results_and_marks_are_those_of_this_process(tmp_path: Path, address: str) -> None:
    for name, executor in (("here", Serial()), ("there", Scheduler(address))):
        outcomes = outcomes_of(tasks.fail_on_bad, items(tmp_path / name, "a", "bad", "ccc"), executor)
        assert [outcome.state for outcome in outcomes] == [State.DONE, State.FAILED, State.DONE]
        assert "in fail_on_bad" in outcomes[1].traceback
    here, there = (read_run_files(tmp_path / name) for name in ("here", "there"))
    assert sorted(here) == [".0.txt.done", ".2.txt.done", "0.txt", "2.txt"]
    assert here == there


def test_a_poisonous_item_loses_only_itself(tmp_path: Path, address: str) -> None:
    outcomes = outcomes_of(tasks.die_on_bad, items(tmp_path, "a", "bad", "c", "d"), Scheduler(address))
    assert [outcome.state.value for outcome in outcomes] == ["done", "failed", "done", "done"]
    assert "process died" in outcomes[1].message


def test_a_worker_that_is_killed_loses_nothing(tmp_path: Path, address: str) -> None:
    threading.Thread(target=kill_first, args=(tmp_path / "pids",), daemon=True).start()
    outcomes = outcomes_of(tasks.take_a_while, items(tmp_path, "a", "b", "c", pids=tmp_path / "pids"), Scheduler(address))
    assert [outcome.state for outcome in outcomes] == [State.DONE] * 3


def test_an_item_that_takes_too_long_is_given_up_and_says_where_it_was(tmp_path: Path, address: str) -> None:
    outcomes = outcomes_of(tasks.hang_on_bad, items(tmp_path, "a", "bad"), Scheduler(address, limit_s=0.3))
    assert [outcome.state for outcome in outcomes] == [State.DONE, State.FAILED]
    assert "within --time-limit (0.3 s)" in outcomes[1].message
    assert "in hang_on_bad" in outcomes[1].traceback


def test_workers_of_other_software_are_refused_before_the_first_item(tmp_path: Path, address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    here = {**build(), "numpy": "1.0"}
    monkeypatch.setattr(scheduler, "refuse_other_build", lambda worker, found, _: refuse_other_build(worker, found, here))
    with pytest.raises(InputError, match=r"worker tcp://.*numpy is '.*' there and '1.0' here"):
        outcomes_of(tasks.write, items(tmp_path, "a"), Scheduler(address))
    assert list(tmp_path.iterdir()) == []


def test_a_worker_that_came_later_says_that_it_is_of_other_software(tmp_path: Path) -> None:
    job = job_of(tasks.write, *items(tmp_path, "a"))
    outcome = scheduler.perform_as({**build(), "sources": "others"}, str(Path.cwd()), job, None)
    assert outcome.state is State.FAILED
    assert "sources is" in outcome.message
    assert list(tmp_path.iterdir()) == []


def test_a_scheduler_that_is_gone_is_waited_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    gone = Programs(tmp_path / "cluster")
    pids = tmp_path / "pids"

    def lose_scheduler() -> None:
        while not pids.exists():
            time.sleep(0.01)
        gone.scheduler.send_signal(signal.SIGKILL)
        gone.end()
        gone.begin()

    other = threading.Thread(target=lose_scheduler)
    other.start()
    try:
        outcomes = outcomes_of(tasks.take_a_while, items(tmp_path / "out", "a", "b", "c", pids=pids), Scheduler(gone.address))
    finally:
        pids.touch()  # lets the other thread end where nothing was begun
        other.join()
        gone.end()
    assert [outcome.state for outcome in outcomes] == [State.DONE] * 3
    assert capsys.readouterr().err.count("is gone; waiting for it") == 1


def test_a_scheduler_that_does_not_answer_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduler, "CONNECT_S", 0.2)
    with pytest.raises(TumbleError, match=r"--scheduler tcp://127.0.0.1:9: expected a Dask scheduler to answer within 0.2 s"):
        outcomes_of(tasks.write, items(tmp_path, "a"), Scheduler("tcp://127.0.0.1:9"))


def test_without_dask_a_sentence_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r'pip install "tumble\[cluster\]"'):
        outcomes_of(tasks.write, items(tmp_path, "a"), Scheduler("tcp://127.0.0.1:9"))


def test_an_estimate_is_the_same_file_as_on_one_machine(tmp_path: Path, address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    recipe = Recipe(seed=5, motion=MotionRecipe(frames=10), rig=RigRecipe(drops=2))
    write_observation(build_silhouette_sequence(recipe, 0)[0], tmp_path / "seen")
    for name, executor in (("here", Processes(1, limit_s=100.0)), ("there", Scheduler(address))):
        (outcome,) = estimate_all(Path("seen"), {"momentum_starts": 0}, Path(name), executor=executor, quiet=True)
        assert outcome.state is State.DONE, outcome.message
    here, there = (read_run_files(tmp_path / name) for name in ("here", "there"))
    assert b'"converged"' in here["seen.estimate.json"]
    assert here == there


def read_run_files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_joint_fit_is_not_for_a_scheduler(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["estimate", str(tmp_path), "--effects", "gravity", "--scheduler", "tcp://127.0.0.1:9", "--out", str(tmp_path / "e")]
    assert main(words) == 2
    assert "got one joint fit" in capsys.readouterr().err
