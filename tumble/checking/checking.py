"""``tumble check`` over the observations of a folder, one item each."""

from pathlib import Path
from typing import Any

from datasets.observation_files import read_observation
from tumble.checking.checked import check_observation, plain_check
from tumble.engine import Executor, Item, Outcome, run
from tumble.progress import progress
from tumble.reports.check_page import write_check_page
from tumble.result_files import observations_in


def check_all(source: Path, out: Path, *, executor: Executor, quiet: bool) -> tuple[Outcome, ...]:
    """Check every observation of ``source`` whose page ``out`` lacks."""
    items = [_item(folder, out) for folder in observations_in(source)]
    with progress("check", len(items), quiet=quiet) as advance:
        return run(check_item, items, executor=executor, advance=advance)


def check_item(payload: dict[str, Any]) -> dict[str, Any]:
    """Check one observation and write its page."""
    check = check_observation(read_observation(Path(payload["observation"])))
    write_check_page(check, Path(payload["page"]))
    return plain_check(check)


def _item(folder: Path, out: Path) -> Item:
    page = out / f"{folder.name}.check.html"
    return Item(folder.name, {"observation": folder, "page": page}, page)
