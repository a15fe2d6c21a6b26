"""Every verb is run whole, in a folder whose name a shell has to quote; what it tells to type next is a command that exists."""

import importlib
import shlex
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.estimator.made_trajectories import Hidden, Tracker, campaign
from tests.tumble.test_trajectory_verbs import write_csv
from tests.tumble.verb_inputs import parsers
from tumble.challenge import limit_making
from tumble.cli.main import main
from tumble.written_files import read_run

pytestmark = pytest.mark.long

TESTS = Path(__file__).resolve().parents[1]
SMALL = "--set sequences=1 --set motion.frames=14 --set rig.drops=2 --set 'tier=\"silhouette\"'"
TOSSES = "tosses --gravity=0,0,-9.81"
WHOLE: Mapping[str, tuple[str, str, tuple[str, ...]]] = {
    "doctor": ("", "", ()),
    "render": (SMALL, "dataset.json", ()),
    "import": (
        "render/observations/cut_stone-0000/outlines_hsv.npz --camera render/observations/cut_stone-0000 --particle render "
        "--gravity down --rate 4000 --exposure 50us",
        "observations/outlines_hsv/observation.json",
        ("render",),
    ),
    "shape": ("render", "particle.json", ("render",)),
    "check": ("render", "cut_stone-0000.check.html", ("render",)),
    "estimate": ("render", "cut_stone-0000.estimate.json", ("render",)),
    "score": ("estimate --truth render/truth", "scores.csv", ("estimate",)),
    "report": ("estimate --truth render/truth", "report.html", ("estimate",)),
    "compare": (TOSSES, "report.html", ()),
    "diagnose": (TOSSES, "report.html", ()),
    "explain": (TOSSES, "campaign.json", ()),
    "ladder": (f"{TOSSES} --effects quadratic_drag", "report.html", ()),
    "effect": ("list", "", ()),
    "bench": ("--only kernel", "figures.json", ()),
    "challenge limits": ("--controls 1 --outside 1 --large 1 --sequences 1 --frames 20 --views 6 --table table.json", "c001.json", ()),
}
"""Of a verb: its words, a file that it writes, and the verbs that make what it reads."""
ELSEWHERE: Mapping[str, str] = {
    "quickstart": "tumble/test_measuring.py",
    "calibrate camera": "tumble/test_calibrate.py",
    "calibrate rig": "tumble/test_calibrate.py",
    "calibrate gravity": "tumble/test_calibrate_gravity.py",
    "calibrate check": "tumble/test_calibrate_check.py",
    "validate-contact": "tumble/test_validate_contact.py",
    "gate": "tumble/test_gate.py",
    "leaderboard": "rivals/test_rivals.py",
    "benchmark list": "tumble/test_benchmark.py",
    "benchmark show": "tumble/test_benchmark.py",
    "benchmark make": "tumble/test_benchmark.py",
    "benchmark verify": "tumble/test_benchmark.py",
    "cluster": "tumble/test_cluster.py",
    "challenge make": "tumble/challenge/test_whole.py",
    "challenge solve": "tumble/challenge/test_whole.py",
    "challenge score": "tumble/challenge/test_whole.py",
    "challenge hidden": "tumble/challenge/test_whole.py",
}
"""Verbs that a test of their own runs whole."""
MISSED = {"doctor", "bench", "estimate"}
"""Verbs whose answer depends on the machine, or on how sure a small recording is: 1 is an answer, too."""


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with three tosses, whose name has a blank and a quote in it."""
    folder = tmp_path_factory.mktemp("whole") / "it's a day"
    (folder / "tosses").mkdir(parents=True)
    for trajectory in campaign(8, Hidden(drag=0.3), Tracker(rows=20), sequences=3):
        write_csv(trajectory, folder / "tosses")
    return folder


def done(verb: str, work: Path, words: str) -> int:
    """Run a verb; its folder has its name."""
    makes_folder = {name for name, parser in parsers() if any(action.dest == "resume" for action in parser._actions)}
    out = ["--out", str(work / verb.replace(" ", "-"))] if verb in makes_folder else []
    made = {path.name for path in work.iterdir()}
    given = [str(work / word) if Path(word).parts[0] in made else word for word in shlex.split(words)]
    return main([*verb.split(), *given, *out])


def ready(verb: str, work: Path) -> None:
    """See to it that what ``verb`` reads is there."""
    words, product, needs = WHOLE[verb]
    for need in needs:
        ready(need, work)
    if not (work / verb / product).exists():
        assert done(verb, work, words) in ({0, 1} if verb in MISSED else {0})


def test_every_verb_is_run_by_a_test() -> None:
    assert {*WHOLE, *ELSEWHERE} == {name for name, _ in parsers()}
    for verb, file in ELSEWHERE.items():
        assert f'"{verb.split()[-1]}"' in (TESTS / file).read_text(encoding="utf-8"), verb


@pytest.mark.parametrize("verb", list(WHOLE))
def test_a_verb_runs_whole(
    verb: str, work: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("COLUMNS", raising=False)
    monkeypatch.setattr(limit_making, "SIZE", dict(list(limit_making.SIZE.items())[:1]))
    monkeypatch.setattr(limit_making, "LARGE", limit_making.LARGE[:1])
    words, product, needs = WHOLE[verb]
    for need in needs:
        ready(need, work)
    capsys.readouterr()
    code = done(verb, work, words) if not (work / verb / product).is_file() else 0
    said = capsys.readouterr().out
    assert code in ({0, 1} if verb in MISSED else {0}), said
    if product:
        folder = work / verb.replace(" ", "-")
        assert (folder / product).is_file()
        described = read_run(folder) or {}
        assert described["state"] == "finished"
        assert product in described["files"]
    for line in said.splitlines():
        if line.startswith("next: "):
            parses(line.removeprefix("next: "))


def parses(line: str) -> None:
    """A command that ``tumble`` can read, with every path of the run whole."""
    program, verb, *rest = shlex.split(line)
    assert program == "tumble"
    importlib.import_module(f"tumble.cli.{verb.replace('-', '_')}").parser().parse_args(rest)
    assert not any("it's" in word and not Path(word).is_absolute() for word in rest if "=" not in word), line


def test_the_command_of_a_run_can_be_pasted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ["tumble", "render", *shlex.split(SMALL), "--set", 'name="it"', "-q", "--jobs", "1", "--out", str(tmp_path / "it's")]
    monkeypatch.setattr("sys.argv", words)
    assert main() == 0
    assert shlex.split((read_run(tmp_path / "it's") or {})["command"]) == words


def test_a_table_in_a_pipe_is_not_folded(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    assert main(["effect", "list", "-q"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) > 150
    assert sum(line.startswith("quadratic_drag") for line in lines) == 1
