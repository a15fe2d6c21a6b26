"""The engine loses no item because of another, skips what is there, and names what failed."""

from pathlib import Path

import pytest

from tests.tumble import tasks
from tumble.engine import Item, State, failures, run


def items(folder: Path, *texts: str) -> list[Item]:
    return [_item(k, text, folder / f"{k}.txt") for k, text in enumerate(texts)]


def _item(number: int, text: str, product: Path) -> Item:
    return Item(f"item {number}", {"text": text, "product": str(product)}, product)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_failing_item_is_named_and_its_neighbours_finish(tmp_path: Path, jobs: int) -> None:
    work = items(tmp_path, "a", "bad", "ccc")
    outcomes = run(tasks.fail_on_bad, work, jobs=jobs, advance=lambda name: None)
    assert [outcome.state for outcome in outcomes] == [State.DONE, State.FAILED, State.DONE]
    assert failures(outcomes)[0].name == "item 1"
    assert failures(outcomes)[0].message == "ValueError: this one is bad"
    assert outcomes[2].result == {"length": 3}
    assert (tmp_path / "2.txt").read_text(encoding="utf-8") == "ccc"


def test_a_dying_process_loses_only_its_own_item(tmp_path: Path) -> None:
    work = items(tmp_path, "a", "bad", "c", "d", "bad", "e")
    outcomes = run(tasks.die_on_bad, work, jobs=2, advance=lambda name: None)
    assert [outcome.state.value for outcome in outcomes] == ["done", "failed", "done", "done", "failed", "done"]
    assert "process died" in outcomes[1].message


def test_finished_items_are_skipped(tmp_path: Path) -> None:
    work = items(tmp_path, "a", "b")
    work[0].product.write_text("from before", encoding="utf-8")
    seen: list[str] = []
    outcomes = run(tasks.write, work, jobs=1, advance=seen.append)
    assert [outcome.state for outcome in outcomes] == [State.SKIPPED, State.DONE]
    assert work[0].product.read_text(encoding="utf-8") == "from before"
    assert sorted(seen) == ["item 0", "item 1"]


def test_an_interrupt_passes_through(tmp_path: Path) -> None:
    def interrupt(name: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(tasks.write, items(tmp_path, "a", "b", "c"), jobs=2, advance=interrupt)
