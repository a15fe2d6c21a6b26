"""What studies on drawn bodies share: their arguments, and how figures and pages are written."""

import argparse
import json
import secrets
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from datasets.atomic_files import written_whole
from studies.reporting.words import write_page

LARGEST_SEED = 2**31


def body_study_arguments(description: str | None, bodies: int) -> argparse.Namespace:
    """The arguments of a study on ``bodies`` drawn ones; its seed is drawn unless one is given."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bodies", type=int, default=bodies)
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--result", type=Path)
    parser.add_argument("--page", type=Path)
    arguments = parser.parse_args()
    if arguments.seed is None:
        arguments.seed = secrets.randbelow(LARGEST_SEED)
    return arguments


def write_body_study(result: Mapping[str, Any], page: Callable[[Any], Sequence[str]], arguments: argparse.Namespace) -> None:
    """Write the figures and their page where they are asked for."""
    if arguments.result:
        with written_whole(arguments.result) as temporary:
            temporary.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    if arguments.page:
        write_page(page(result), arguments.page)
