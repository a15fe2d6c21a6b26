"""An output directory belongs to one run and is never overwritten silently."""

import json
from pathlib import Path

import pytest

from datasets.errors import InputError
from tumble.differences import first_difference
from tumble.output_directory import Run, note_failures, output_directory
from tumble.written_files import read_run

RUN = Run("render", {"motion": {"frames": 5}}, seed=7, variant="scalar_rgb", reads=())


def write_once(path: Path, run: Run = RUN, *, resume: bool = False, force: bool = False) -> None:
    with output_directory(path, run, resume=resume, force=force) as out:
        (out / "product.txt").write_text("x", encoding="utf-8")


def test_run_json_describes_the_run(tmp_path: Path) -> None:
    write_once(tmp_path / "out")
    document = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))
    assert document["state"] == "finished"
    assert document["configuration"] == {"motion": {"frames": 5}}
    assert (document["seed"], document["variant"], document["schema_version"]) == (7, "scalar_rgb", 1)
    assert document["versions"]["numpy"]


def test_a_finished_run_is_kept_unless_told_otherwise(tmp_path: Path) -> None:
    write_once(tmp_path)
    with pytest.raises(InputError, match=r"finished run of `tumble render`.*--resume.*--force"):
        write_once(tmp_path)
    write_once(tmp_path, resume=True)
    (tmp_path / "old").mkdir()
    write_once(tmp_path, force=True)
    assert not (tmp_path / "old").exists()


def test_a_run_that_stopped_is_unfinished(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), output_directory(tmp_path, RUN, resume=False, force=False):
        raise KeyboardInterrupt
    assert (read_run(tmp_path) or {})["state"] == "unfinished"
    with pytest.raises(InputError, match="unfinished run"):
        write_once(tmp_path)
    write_once(tmp_path, resume=True)


def test_a_run_that_lost_items_does_not_read_as_finished(tmp_path: Path) -> None:
    with output_directory(tmp_path, RUN, resume=False, force=False):
        (tmp_path / "0002.json").write_text("whole", encoding="utf-8")
        note_failures(tmp_path, {"0003": "the disk is full"})
    document = read_run(tmp_path) or {}
    assert document["state"] == "finished_with_failures"
    assert document["failures"] == [{"item": "0003", "reason": "the disk is full"}]
    assert document["configuration"] == {"motion": {"frames": 5}}
    with pytest.raises(InputError, match=r"a run of `tumble render` that finished with failures \(1\)\. Add --resume"):
        write_once(tmp_path)
    write_once(tmp_path, resume=True)
    mended = read_run(tmp_path) or {}
    assert (mended["state"], mended["failures"]) == ("finished", [])


def test_a_run_of_which_nothing_is_there_does_not_hinder_the_next(tmp_path: Path) -> None:
    with output_directory(tmp_path, RUN, resume=False, force=False):
        note_failures(tmp_path, {"0000": "expected pictures, got none"})
    write_once(tmp_path)


def test_failures_of_a_run_that_was_stopped_are_kept(tmp_path: Path) -> None:
    def lose_one_and_stop() -> None:
        with output_directory(tmp_path, RUN, resume=False, force=False):
            note_failures(tmp_path, {"0003": "its process died"})
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        lose_one_and_stop()
    document = read_run(tmp_path) or {}
    assert (document["state"], document["failures"][0]["item"]) == ("unfinished", "0003")


def test_resuming_another_run_names_the_difference(tmp_path: Path) -> None:
    write_once(tmp_path)
    with pytest.raises(InputError, match=r"configuration\.motion\.frames was 5 and is now 6"):
        write_once(tmp_path, Run("render", {"motion": {"frames": 6}}, reads=()), resume=True)


def test_a_folder_of_somebody_else_is_left_alone_even_with_force(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("x", encoding="utf-8")
    with pytest.raises(InputError, match=r"no run of tumble wrote \(thesis\.tex\)"):
        write_once(tmp_path, force=True)
    assert (tmp_path / "thesis.tex").exists()


def test_a_second_run_in_one_folder_is_refused_and_names_the_process(tmp_path: Path) -> None:
    with output_directory(tmp_path, RUN, resume=False, force=False), pytest.raises(InputError, match=r"process \d+ is writing there"):
        write_once(tmp_path, force=True)


def test_first_difference_of_equal_values_is_empty() -> None:
    assert first_difference({"a": [1, {"b": 2}]}, {"a": [1, {"b": 2}]}) == ""
    assert first_difference({"a": 1}, {}) == "a was 1 and is now None"
