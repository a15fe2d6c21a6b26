"""Sequences that a campaign is asked to do without are not used, told, and left out by what comes next, too."""

from pathlib import Path

import pytest

from datasets.errors import InputError
from datasets.json_documents import read_document
from estimator.data.configuration import Configuration
from tests.estimator.made_trajectories import Hidden, Tracker, campaign
from tests.tumble.test_trajectory_verbs import write_csv
from tumble.campaigning import Known, prepare
from tumble.cli.main import main


@pytest.fixture
def tosses(tmp_path: Path) -> Path:
    folder = tmp_path / "tosses"
    folder.mkdir()
    (folder / "trajectory.toml").write_text("gravity_world = [0.0, 0.0, -9.81]\n")
    for t in campaign(8, Hidden(drag=0.1), Tracker(rows=20, orientation=False), sequences=4):
        write_csv(t, folder)
    return folder


def names_without(tosses: Path, *without: str) -> tuple[str, ...]:
    return prepare(tosses, Configuration(), (), quiet=True, known=Known(without=without)).names


def test_they_are_not_used(tosses: Path) -> None:
    first, second, third, fourth = names_without(tosses)
    assert names_without(tosses, second, fourth) == (first, third)


def test_a_broken_one_that_is_not_used_is_not_missed(tosses: Path) -> None:
    (tosses / "broken.csv").write_text("t_s,x_m,y_m,z_m\n0,1,2\n")
    known = Known(without=("broken",))
    assert not prepare(tosses, Configuration(), (), quiet=True, known=known).left_out
    assert prepare(tosses, Configuration(), (), quiet=True).left_out


def test_two_files_of_one_name_are_still_told(tosses: Path) -> None:
    there = names_without(tosses)
    (tosses / f"{there[0]}.txt").write_text((tosses / f"{there[1]}.csv").read_text())
    found = prepare(tosses, Configuration(), (), quiet=True)
    assert found.names == there
    assert set(found.left_out) == {f"{there[0]}.txt"}


def test_a_name_that_none_has_is_refused_with_those_that_there_are(tosses: Path) -> None:
    there = names_without(tosses)
    with pytest.raises(InputError, match="got toss_x; there are ") as refused:
        names_without(tosses, "toss_x")
    assert all(name in str(refused.value) for name in there)
    with pytest.raises(InputError, match="to leave a sequence, got all 4"):
        names_without(tosses, *there)


@pytest.mark.parametrize("verb", ["compare", "estimate"])
def test_verbs_take_it_and_say_so(tosses: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: str) -> None:
    gone, *there = names_without(tosses)
    out = tmp_path / "out"
    assert main([verb, str(tosses), "--without", gone, "--out", str(out)]) == 0
    said = capsys.readouterr()
    assert f"1 of 4 sequences are not used, as --without asks: {gone}." in said.err
    assert f"--without {gone}" in (out / "run.json").read_text()
    if verb == "estimate":
        assert {path.name.partition(".")[0] for path in out.glob("*.estimate.json")} == set(there)
    else:
        found = read_document(out / "diagnosis.json", "diagnosis")
        assert set(found["sequences"]) == set(there)
        assert f"--without {gone}" in found["verdict"]["next"]


def test_without_a_name_it_is_refused(tosses: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as refused:
        main(["compare", str(tosses), "--without", " , "])
    assert refused.value.code == 2
    assert "expected names with commas" in capsys.readouterr().err
