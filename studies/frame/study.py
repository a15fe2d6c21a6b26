"""What a study is: a plan, which says what is measured, and a page, which says what came of it.

The two lie in files of their own. A committed result carries the digest of its plan's files: where they change, it has to be measured
anew. Where the page's file changes, page and picture are written anew from the committed rows, in seconds.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from matplotlib.figure import Figure

from studies.frame.results import Result

Scalar = float | int | str | bool
Row = dict[str, Any]


@dataclass(frozen=True)
class Settings:
    """What a study may be asked for; a plan that varies more adds its own fields.

    ``seed``: of everything that is drawn. ``count``: repetitions of every point; cases of a repetition do not depend on it, so that a
    study can be gone on with for more of them.
    """

    seed: int
    count: int


S = TypeVar("S", bound=Settings)


@dataclass(frozen=True)
class Case:
    """One piece of work: its name, unique in the study; ``labels`` that say which point it belongs to; what the task is told."""

    name: str
    labels: Mapping[str, Scalar]
    payload: Mapping[str, Any]


@dataclass(frozen=True)
class Plan(Generic[S]):
    """What is measured.

    Parameters
    ----------
    small, full
        The settings of both sizes.
    cases
        From settings and the folder of scanned particles (``None``: the project's own bodies) to all cases, one repetition after the other.
    task
        A function of a module, from a case's payload to its rows. It sees the truth and scores with it; the estimator sees observations.
    modules
        The files that decide a row besides the libraries: the plan's own and the task's.
    """

    small: S
    full: S
    cases: Callable[[S, Path | None], list[Case]]
    task: Callable[[dict[str, Any]], list[Row]]
    modules: tuple[str, ...]


@dataclass(frozen=True)
class Study:
    """A plan and its page; ``page`` and ``picture`` see the result alone. ``module``: of both."""

    name: str
    question: str
    plan: Plan[Any]
    page: Callable[[Result], Sequence[str]]
    picture: Callable[[Result], Figure]
    module: str
