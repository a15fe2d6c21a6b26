"""A check on the screen: figures, where values are from, and what speaks against the recording."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.table import Table

from tumble.cli.console import console
from tumble.cli.exit_codes import ALL_MEASURED, INCOMPLETE
from tumble.cli.outcomes import exit_code, what_next
from tumble.engine import Outcome, State


def say_values(name: str, values: Sequence[Mapping[str, Any]]) -> None:
    """A table of values with where each is from."""
    table = Table(box=None, pad_edge=False)
    for head in (name, "", "from", ""):
        table.add_column(head, overflow="fold")  # a path that is cut off says nothing
    for value in values:
        table.add_row(value["name"].replace("_", " "), value["value"], value["origin"], value["note"])
    console().print(table)


def say_check(check: Mapping[str, Any], *, with_values: bool) -> None:
    """The figures of every camera and the findings."""
    out = console()
    if with_values:
        say_values(check["name"], check["values"])
    for part, rows in check["figures"].items():
        table = Table(f"{check['name']}, {part}", "", box=None, pad_edge=False)
        for name, text in rows.items():
            table.add_row(name, text)
        out.print(table)
    for finding in check["findings"]:
        out.print(f"{'bad' if finding['bad'] else 'note'}: {finding['sentence']}", soft_wrap=True)
    for remark in check["remarks"]:
        out.print(f"note: {remark}", soft_wrap=True)


def check_code(outcomes: Sequence[Outcome]) -> int:
    """The exit code of recordings that were checked: 1 where something speaks against a measurement of one."""
    return max(exit_code(outcomes), ALL_MEASURED if _good(outcomes) else INCOMPLETE)


def check_next(outcomes: Sequence[Outcome], then: str) -> str:
    """The last line of a check: ``then`` is what to type where nothing speaks against a measurement of any."""
    made = any(outcome.state is not State.FAILED for outcome in outcomes)
    return what_next(then if made and _good(outcomes) else None)


def _good(outcomes: Sequence[Outcome]) -> bool:
    return all(outcome.result["good"] for outcome in outcomes if outcome.state is State.DONE)
