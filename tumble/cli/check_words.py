"""A check on the screen: figures, where values are from, and what speaks against the recording."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.table import Table

from tumble.cli.console import console


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
