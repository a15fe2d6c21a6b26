"""The regression gate: whether a run is worse than the committed baseline, on the same sequences.

Runs are paired by sequence (:mod:`datasets.scoring.paired`) for every kind of sequence and every measure of it; what is added to errors is
the measure's own floor at least, and ratios are cut at ``JUMP``. The run is

* *worse* in a measure where the whole interval lies above ``TOLERATED``, *better* where it lies below its inverse, otherwise the same;
* worse in a kind where more sequences are lost than fresh noise loses: measured in the baseline and not any more (of a campaign: hidden
  effects named, and no others). Of ``n`` sequences noise loses a binomial number, each with ``LOST_SHARE``. The same test is made of the
  campaigns with nothing hidden, which a false name alone loses, and of all kinds together, where every kind that lost is then worse.

All ``m`` decisions of a run share one rate of false alarms: each has the level ``FALSE_ALARMS / m`` [Bonferroni; Dunn 1961], so that a
run that is as good as the baseline is called worse with a chance of at most ``FALSE_ALARMS``. That is a rate over baselines drawn, as the
runs are, with fresh noise; beside one that is kept, lucky or unlucky, it may be another. The tolerance is on the safe side.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.special import bdtrc

from datasets.errors import InputError
from datasets.json_documents import Document, parsed_json, read_document, revived, write_document
from datasets.scoring.gate_measures import MEASURES, Measure
from datasets.scoring.paired import differences, log_ratios, paired

Row = Mapping[str, Any]
Rows = Mapping[str, Sequence[Row]]
"""Of every kind: a row per sequence, with its ``sequence``, ``status``, whether it is ``measured``, and its measures."""

FALSE_ALARMS = 0.05
"""Chance at most that a run as good as its baseline is called worse, where both have fresh noise."""
TOLERATED = 1.1
"""Ratio of typical errors that is not worth an alarm."""
JUMP = 3.0
"""Ratio at which ratios are cut."""
FEW = 6
"""With fewer sequences of a kind only gross faults show: of five the interval reaches some three standard deviations of the log-ratios
to either side (Student's t at the level of a decision)."""
LOST_SHARE = 0.01
"""Chance that fresh noise loses a sequence of a set, by judgement: three realisations of the quick set's noise lost 6 of 270 from one to
another (docs/studies/gate.md), too few to set it. Where noise loses more than this share, ``FALSE_ALARMS`` need not hold."""
CAMPAIGNS = "campaigns"
NAMED = 5
"""How many sequences a sentence names at most."""

Verdict = Literal["better", "same", "worse"]


@dataclass(frozen=True)
class Baseline:
    """A run to compare with: its ``rows``, ``cpu_s`` of every kind, and where it was made (versions, machine).

    ``set_file``: the file of the set that the sequences are made from, relative to the baseline's folder; ``made_from``: what was in it.
    """

    rows: Rows
    environment: dict[str, str]
    set_file: str
    made_from: dict[str, Any]
    cpu_s: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Comparison:
    """One measure of one kind: the mean ratio new over old over ``n`` sequences, with its interval; above one is worse.

    ``sequences``: those that are worse by more than is tolerated, worst first, with their ratios.
    """

    kind: str
    measure: Measure
    n: int
    ratio: float
    low: float
    high: float
    sequences: tuple[tuple[str, float], ...]

    @property
    def verdict(self) -> Verdict:
        """Where the whole interval lies."""
        if self.low > TOLERATED:
            return "worse"
        return "better" if self.high < 1 / TOLERATED else "same"


@dataclass(frozen=True)
class Losses:
    """Of ``n`` sequences of a kind those that were ``lost``, with their status, and ``gained``; ``worse``: more than noise loses."""

    kind: str
    n: int
    lost: Mapping[str, str]
    gained: tuple[str, ...]
    worse: bool


@dataclass(frozen=True)
class GateResult:
    """All comparisons and losses; ``failed``: what could not be computed at all, which makes a run worse whatever the rest says.

    ``controls``: losses of campaigns with nothing hidden; ``together``: losses of all kinds. ``None`` where there are none, or one kind.
    """

    comparisons: tuple[Comparison, ...]
    losses: tuple[Losses, ...]
    failed: Mapping[str, str] = field(default_factory=dict)
    controls: Losses | None = None
    together: Losses | None = None

    @property
    def widest(self) -> Comparison | None:
        """The comparison with the largest upper end: what worsening may be there unseen."""
        return max(self.comparisons, key=lambda each: each.high, default=None)

    @property
    def few(self) -> tuple[str, ...]:
        """Kinds of so few sequences that only gross faults show."""
        return tuple(losses.kind for losses in self.losses if losses.n < FEW)

    @property
    def decisions(self) -> int:
        """How many decisions share the rate of false alarms."""
        return len(self.comparisons) + len(self.losses) + sum(each is not None for each in (self.controls, self.together))

    @property
    def worse(self) -> bool:
        """Whether the run is worse than the baseline."""
        return bool(self.failed) or any(self.verdict(losses.kind) == "worse" for losses in self.losses)

    def verdict(self, kind: str) -> Verdict:
        """Of one kind: worse where anything is, better where something is and nothing worse."""
        found = [each.verdict for each in self.comparisons if each.kind == kind]
        if "worse" in found or any(losses.kind == kind and self._is_worse(losses) for losses in self.losses):
            return "worse"
        return "better" if "better" in found else "same"

    def _is_worse(self, losses: Losses) -> bool:
        of_all = self.together is not None and self.together.worse and bool(losses.lost)
        of_controls = self.controls is not None and self.controls.worse and losses.kind == self.controls.kind
        return losses.worse or of_all or of_controls

    def sequences(self, kind: str) -> tuple[str, ...]:
        """The sequences of a kind to look at, worst first, without repetition."""
        named = [name for losses in self.losses if losses.kind == kind for name in losses.lost]
        named += [name for each in self.comparisons if each.kind == kind and each.verdict == "worse" for name, _ in each.sequences[:NAMED]]
        return tuple(dict.fromkeys(named))


def write_baseline(path: Path, baseline: Baseline) -> None:
    """Write a baseline, to be committed with a reason."""
    kept = {kind: [_kept(kind, row) for row in rows] for kind, rows in baseline.rows.items()}
    content: Document = {"environment": baseline.environment, "set": baseline.set_file, "made_from": baseline.made_from}
    write_document(path, "baseline", {**content, "kinds": kept, "cpu_s": baseline.cpu_s})


def load_baseline(path: Path) -> Baseline:
    """Read a baseline.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    if _is_of_flights_alone(parsed_json(path)):
        raise InputError(
            f"{path}: expected a baseline of several kinds of sequences (schema with $.kinds), got one of an earlier Tumble, of flights "
            "alone ($.rows); write it anew with --write."
        )
    document = read_document(path, "baseline")
    if unknown := [kind for kind in document["kinds"] if kind not in MEASURES]:
        raise InputError(f"{path}: at $.kinds: expected {', '.join(MEASURES)}, got {unknown[0]}; write the baseline anew with --write.")
    rows = {kind: tuple(revived(row) for row in found) for kind, found in document["kinds"].items()}
    for kind, found in rows.items():
        for row in found:
            if lacking := [each.key for each in MEASURES[kind] if each.key not in row]:
                raise InputError(
                    f'{path}: at $.kinds.{kind}: sequence "{row["sequence"]}": expected the measures of this version, got none for '
                    f"{lacking[0]}; write the baseline anew with --write."
                )
    return Baseline(rows, document["environment"], document["set"], document["made_from"], document["cpu_s"])


def compare(baseline: Baseline, candidate: Rows, failed: Mapping[str, str] | None = None) -> GateResult:
    """Compare a run's rows with a baseline.

    Parameters
    ----------
    baseline
        As from :func:`load_baseline`.
    candidate
        Rows of the same kinds and sequences.
    failed
        What could not be computed, with the reason.

    Raises
    ------
    InputError
        Where the candidate lacks a sequence of the baseline, or has one that the baseline lacks.
    """
    kinds = [kind for kind in MEASURES if kind in baseline.rows]
    pairs = {kind: (_by_name(baseline.rows[kind]), _by_name(candidate.get(kind, ()))) for kind in kinds}
    for kind, (old, new) in pairs.items():
        _check_same(kind, old, new)
    controls = [name for name, plan in baseline.made_from.get(CAMPAIGNS, {}).items() if not plan["hidden"]]
    decisions = sum(1 + len(MEASURES[kind]) for kind in kinds) + (len(controls) > 0) + (len(kinds) > 1)
    level = FALSE_ALARMS / max(decisions, 1)
    comparisons = tuple(_comparison(kind, measure, pair, level) for kind, pair in pairs.items() for measure in MEASURES[kind])
    losses = tuple(_losses(kind, old, new, level) for kind, (old, new) in pairs.items())
    false_names = _of_controls(pairs[CAMPAIGNS], controls, level) if controls else None
    return GateResult(comparisons, losses, dict(failed or {}), false_names, _together(losses, level) if len(kinds) > 1 else None)


def _is_of_flights_alone(document: object) -> bool:
    return isinstance(document, dict) and document.get("format") == "tumble baseline" and "rows" in document and "kinds" not in document


def _kept(kind: str, row: Row) -> dict[str, Any]:
    return {key: row[key] for key in ("sequence", "status", "measured", *(measure.key for measure in MEASURES[kind]))}


def _by_name(rows: Sequence[Row]) -> dict[str, Row]:
    return {str(row["sequence"]): row for row in rows}


def _check_same(kind: str, old: Mapping[str, Row], new: Mapping[str, Row]) -> None:
    missing, extra = [name for name in old if name not in new], [name for name in new if name not in old]
    if missing:
        raise InputError(f"{kind}: expected every sequence of the baseline, got none for {_names(missing)}.")
    if extra:
        raise InputError(
            f"{kind}: expected the sequences of the baseline, got {_names(extra)} besides; write the baseline anew with --write."
        )


def _comparison(kind: str, measure: Measure, pair: tuple[Mapping[str, Row], Mapping[str, Row]], level: float) -> Comparison:
    names = list(pair[0])
    before, after = (np.array([rows[name][measure.key] for name in names], dtype=np.float64) for rows in pair)
    logs = differences(before, after) if measure.nats else log_ratios(before, after, least=measure.floor)
    found = paired(logs, cut=JUMP, level=level)
    order = np.argsort(-np.nan_to_num(found.log_ratios, nan=-np.inf), kind="stable")
    worse = tuple((names[k], float(np.exp(found.log_ratios[k]))) for k in order if found.log_ratios[k] > np.log(TOLERATED))
    return Comparison(kind, measure, found.n, found.ratio, found.low, found.high, worse)


def _losses(kind: str, old: Mapping[str, Row], new: Mapping[str, Row], level: float) -> Losses:
    lost = {name: str(new[name]["status"]) for name in old if old[name]["measured"] and not new[name]["measured"]}
    gained = tuple(name for name in old if new[name]["measured"] and not old[name]["measured"])
    return Losses(kind, len(old), lost, gained, _too_many(len(lost), len(old), level))


def _of_controls(pair: tuple[Mapping[str, Row], Mapping[str, Row]], controls: Sequence[str], level: float) -> Losses:
    old, new = ({name: rows[name] for name in controls} for rows in pair)
    return _losses(CAMPAIGNS, old, new, level)


def _together(losses: Sequence[Losses], level: float) -> Losses:
    lost = {f"{each.kind}/{name}": status for each in losses for name, status in each.lost.items()}
    gained = tuple(f"{each.kind}/{name}" for each in losses for name in each.gained)
    n = sum(each.n for each in losses)
    return Losses("all kinds", n, lost, gained, _too_many(len(lost), n, level))


def _too_many(lost: int, n: int, level: float) -> bool:
    """Whether noise loses so many of ``n`` with a chance below ``level``."""
    return lost > 0 and float(bdtrc(lost - 1, n, LOST_SHARE)) < level


def _names(names: Sequence[str]) -> str:
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more
