"""The engine loses no item because of another, skips what is done, refuses what was done otherwise, and names what failed."""

import os
import signal
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from datasets.errors import InputError
from tests.tumble import tasks
from tumble.engine import Executor, Item, Outcome, Processes, Serial, State, Task, failures, run
from tumble.engine.items import plain_paths
from tumble.engine.marks import mark_path

ONE_AND_TWO = pytest.mark.parametrize("executor", [Serial(), Processes(2)], ids=["serial", "processes"])


def items(folder: Path, *texts: str, **more: Any) -> list[Item]:
    return [_item(k, text, folder / f"{k}.txt", more) for k, text in enumerate(texts)]


def _item(number: int, text: str, product: Path, more: dict[str, Any]) -> Item:
    return Item(f"item {number}", {"text": text, "product": product, **more}, product)


def outcomes_of(task: Task, work: list[Item], executor: Executor) -> tuple[Outcome, ...]:
    return run(task, work, executor=executor, advance=lambda name: None)


@ONE_AND_TWO
def test_a_failing_item_is_named_and_its_neighbours_finish(tmp_path: Path, executor: Executor) -> None:
    outcomes = outcomes_of(tasks.fail_on_bad, items(tmp_path, "a", "bad", "ccc"), executor)
    assert [outcome.state for outcome in outcomes] == [State.DONE, State.FAILED, State.DONE]
    assert failures(outcomes)[0].name == "item 1"
    assert failures(outcomes)[0].message == "ValueError: this one is bad"
    assert "in fail_on_bad" in failures(outcomes)[0].traceback
    assert outcomes[2].result == {"length": 3}
    assert (tmp_path / "2.txt").read_text(encoding="utf-8") == "ccc"


def test_a_dying_process_loses_only_its_own_item(tmp_path: Path) -> None:
    outcomes = outcomes_of(tasks.die_on_bad, items(tmp_path, "a", "bad", "c", "d", "bad", "e"), Processes(2))
    assert [outcome.state.value for outcome in outcomes] == ["done", "failed", "done", "done", "failed", "done"]
    assert "process died" in outcomes[1].message


def test_a_worker_that_is_killed_loses_nothing(tmp_path: Path) -> None:
    threading.Thread(target=kill_first, args=(tmp_path / "pids",), daemon=True).start()
    outcomes = outcomes_of(tasks.take_a_while, items(tmp_path, "a", "b", "c", pids=tmp_path / "pids"), Processes(2))
    assert [outcome.state for outcome in outcomes] == [State.DONE] * 3
    assert len((tmp_path / "pids").read_text(encoding="utf-8").split()) == 4


def kill_first(pids: Path) -> None:
    """Kill the process that wrote its number first."""
    while not (pids.exists() and pids.read_text(encoding="utf-8").endswith("\n")):
        time.sleep(0.01)
    os.kill(int(pids.read_text(encoding="utf-8").split()[0]), signal.SIGKILL)


def test_an_item_that_takes_too_long_is_given_up_and_says_where_it_was(tmp_path: Path) -> None:
    outcomes = outcomes_of(tasks.hang_on_bad, items(tmp_path, "a", "bad"), Processes(2, limit_s=0.3))
    assert [outcome.state for outcome in outcomes] == [State.DONE, State.FAILED]
    assert "within --time-limit (0.3 s)" in outcomes[1].message
    assert "in hang_on_bad" in outcomes[1].traceback
    assert sorted(path.name for path in tmp_path.iterdir()) == [".0.txt.done", "0.txt"]


def test_finished_items_are_skipped(tmp_path: Path) -> None:
    outcomes_of(tasks.write, items(tmp_path, "a"), Serial())
    first = (tmp_path / "0.txt").stat().st_mtime_ns
    seen: list[str] = []
    outcomes = run(tasks.write, items(tmp_path, "a", "b"), executor=Serial(), advance=seen.append)
    assert [outcome.state for outcome in outcomes] == [State.SKIPPED, State.DONE]
    assert (tmp_path / "0.txt").stat().st_mtime_ns == first
    assert sorted(seen) == ["item 0", "item 1"]


@pytest.mark.parametrize("left", ["no mark", "half of it", "half a mark"])
def test_a_half_written_product_is_made_again(tmp_path: Path, left: str) -> None:
    product = tmp_path / "0.txt"
    outcomes_of(tasks.write, items(tmp_path, "whole"), Serial())
    if left == "no mark":
        mark_path(product).unlink()
    elif left == "half of it":
        product.write_text("wh", encoding="utf-8")
    else:
        mark_path(product).write_text('{"settings": {"te', encoding="utf-8")
    (outcome,) = outcomes_of(tasks.write, items(tmp_path, "whole"), Serial())
    assert outcome.state is State.DONE
    assert product.read_text(encoding="utf-8") == "whole"


def test_a_run_of_other_settings_is_refused_with_the_difference(tmp_path: Path) -> None:
    outcomes_of(tasks.write, items(tmp_path, "a", seed=1), Serial())
    with pytest.raises(InputError, match="seed was 1 and is now 2"):
        outcomes_of(tasks.write, items(tmp_path, "a", seed=2), Serial())


def test_what_makes_no_difference_is_no_setting(tmp_path: Path) -> None:
    for number in (1, 2):
        (item,) = items(tmp_path, "a", cache=number)
        outcomes = outcomes_of(tasks.write, [replace(item, apart=("cache",))], Serial())
    assert outcomes[0].state is State.SKIPPED


def test_a_folder_that_was_moved_goes_on(tmp_path: Path) -> None:
    outcomes_of(tasks.write, items(tmp_path / "here", "a"), Serial())
    (tmp_path / "here").rename(tmp_path / "there")
    (outcome,) = outcomes_of(tasks.write, items(tmp_path / "there", "a"), Serial())
    assert outcome.state is State.SKIPPED


def test_a_task_gets_absolute_paths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    seen: list[Any] = []
    item = Item("one", {"text": "a", "product": Path("0.txt"), "also": [Path("b")]}, Path("0.txt"))
    run(lambda payload: seen.append(payload) or {}, [item], executor=Serial(), advance=lambda name: None)
    assert seen == [{"text": "a", "product": str(tmp_path / "0.txt"), "also": [str(tmp_path / "b")]}]


def test_an_interrupt_passes_through(tmp_path: Path) -> None:
    def interrupt(name: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(tasks.write, items(tmp_path, "a", "b", "c"), executor=Processes(2), advance=interrupt)


def test_what_items_share_is_not_copied() -> None:
    shared = {"recipe": {"frames": (1, 2)}, "product": Path("a")}
    assert plain_paths(shared)["recipe"] is shared["recipe"]
