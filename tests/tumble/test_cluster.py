"""``tumble cluster``: the job script of a batch system, and refused files; tests of the scheduler run on its local processes."""

import sys
from pathlib import Path

import pytest

from tumble.cli.main import main

pytest.importorskip("distributed")
SLURM = 'system = "slurm"\nworkers = 20\n[job]\ncores = 4\nmemory = "16GB"\nwalltime = "02:00:00"\nqueue = "short"\n'


def refused(path: Path, text: str, *words: str) -> int:
    path.write_text(text, encoding="utf-8")
    return main(["cluster", str(path), *words])


def test_a_dry_run_shows_the_job_of_a_batch_system(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("dask_jobqueue")
    assert refused(tmp_path / "cluster.toml", SLURM, "--dry-run") == 0
    script = capsys.readouterr().out
    for line in ("#SBATCH -p short", "#SBATCH --cpus-per-task=4", "#SBATCH --mem=15G", "#SBATCH -t 02:00:00"):
        assert line in script
    assert "--nthreads 1 " in script
    assert "--nworkers 4 " in script


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (SLURM.replace("slurm", "slrum"), "system: expected one of local, slurm"),
        (SLURM.replace("20", "0"), "workers: expected a whole number of at least 1, got 0"),
        (SLURM.replace("workers", "worker"), "expected system, workers and [job], got worker"),
        (SLURM + 'partition = "short"\n', "[job]: expected options of a job that dask-jobqueue knows"),
        (SLURM, "expected its command sbatch on this machine, got none"),
        ('system = "local"\n[job]\ncores = 2\n', "job: expected options of the jobs of a batch system"),
    ],
)
def test_what_cannot_be_started_is_a_sentence(
    text: str, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("dask_jobqueue")
    monkeypatch.setenv("PATH", str(tmp_path))
    assert refused(tmp_path / "cluster.toml", text) == 2
    assert sentence in capsys.readouterr().err


def test_without_jobqueue_a_sentence_says_what_to_install(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "dask_jobqueue", None)
    assert refused(tmp_path / "cluster.toml", SLURM, "--dry-run") == 2
    assert 'pip install "tumble[cluster]"' in capsys.readouterr().err


def test_a_file_of_the_user_is_not_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.json").write_text("{}", encoding="utf-8")
    assert refused(tmp_path / "cluster.toml", 'system = "local"\n', "--scheduler-file", str(tmp_path / "mine.json")) == 2
    assert "--scheduler-file" in capsys.readouterr().err
    assert (tmp_path / "mine.json").read_text(encoding="utf-8") == "{}"
