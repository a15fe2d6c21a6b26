"""Names are text wherever they are printed."""

from pathlib import Path

import pytest
from rich.table import Table

from datasets.estimate import Estimate, Status
from tumble.cli.estimate import say_estimates
from tumble.console import Console
from tumble.progress import progress

ODD = "[red]x[/red] [/] :smile: [link=file:///etc]y"
ROOT = Path(__file__).resolve().parents[2]


def test_markup_in_sentences_and_tables_is_text(capsys: pytest.CaptureFixture[str]) -> None:
    table = Table("name")
    table.add_row(ODD)
    Console().print(table)
    Console().print(f"{ODD}: {ODD}", soft_wrap=True)
    assert capsys.readouterr().out.count(ODD) == 3


def test_markup_in_names_of_sequences_is_text(capsys: pytest.CaptureFixture[str]) -> None:
    say_estimates([Estimate("[red]x[/red]", Status.NO_CONVERGENCE, f"{ODD} does not converge.")])
    assert capsys.readouterr().out.count("[red]x[/red]") == 3


def test_markup_in_progress_is_text(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with progress("estimate", 2, quiet=False) as advance:
        advance("[/]")  # closes what was never opened: an error if it were markup


def test_no_other_console_is_used() -> None:
    assert [path for path in (ROOT / "tumble").rglob("*.py") if "from rich.console import" in path.read_text(encoding="utf-8")] == []
