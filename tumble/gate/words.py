"""A gate's verdict in sentences and as plain values: kind by kind, what got worse, where to look, what to type next."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from datasets.scoring.gate import CAMPAIGNS, FALSE_ALARMS, FEW, JUMP, NAMED, Comparison, GateResult, Losses
from tumble.challenge.cases import campaign_folder
from tumble.challenge.solving import answer_path
from tumble.commands import command
from tumble.gate.running import ANSWERS, DATASET, ESTIMATES
from tumble.result_files import estimate_path

REPORT = "report"


def sentences(result: GateResult, out: Path, cpu_s: Mapping[str, tuple[float, float]], *, every: bool) -> list[str]:
    """What is printed: a line for each kind and what moved in it; ``every``: all measures; ``cpu_s``: now and in the baseline."""
    said = [f"{name}: failed: {message}" for name, message in result.failed.items()]
    for losses in result.losses:
        kind = losses.kind
        said.append(f"{kind}: {result.verdict(kind)} ({losses.n} sequences{_times(cpu_s.get(kind))})")
        said += [f"  {line}" for line in lost_in_words(losses, result)]
        moved = [each for each in result.comparisons if each.kind == kind and (every or each.verdict != "same")]
        said += [f"  {in_words(each)}" for each in moved]
        said += [f"  look at {place}" for place in places(result, kind, out)]
    said += lost_together(result)
    said.append(summary(result))
    if result.worse and (named := _first_worse(result)):
        said.append(f"next: {next_command(named, out)}")
    return said


def summary(result: GateResult) -> str:
    """The verdict in a sentence."""
    if result.failed:
        return "Worse than the baseline: not everything could be measured."
    verdict = "Worse than the baseline" if result.worse else f"No worsening shown{_not_seen(result)}"
    few = f" Fewer than {FEW} sequences of {' and '.join(result.few)}: only gross faults show there." if result.few else ""
    chance = f"of equally good runs and baselines with fresh noise at most {FALSE_ALARMS:.0%} are called worse"
    return f"{verdict} ({result.decisions} comparisons; {chance}).{few}"


def _not_seen(result: GateResult) -> str:
    """How much worse a run may be unseen: the largest upper end of all intervals."""
    widest = result.widest
    if widest is None:
        return ""
    many = f"up to {widest.high:.2f} times" if widest.high < JUMP else f"{JUMP:g} times and more"
    return f"; errors may be {many} the baseline's ({widest.kind}: {widest.measure.words})"


def in_words(told: Comparison) -> str:
    """One measure: the ratio with its interval, and the sequences that are behind it."""
    said = f"{told.measure.words}: {told.verdict}, {told.ratio:.2f} times the baseline's ({told.low:.2f} to {told.high:.2f})"
    return f"{said}, most in {most_in(told)}" if told.verdict == "worse" else said


def most_in(told: Comparison) -> str:
    """The sequences that are worse in a measure, each with its ratio, which is cut at ``JUMP``."""
    return ", ".join(f"{name} ({'over ' if ratio > 0.999 * JUMP else ''}{ratio:.1f})" for name, ratio in told.sequences[:NAMED])


def lost_in_words(losses: Losses, result: GateResult) -> list[str]:
    """What of a kind is measured no more, and what is newly."""
    named = ", ".join(f"{name} ({status})" for name, status in losses.lost.items())
    said = [f"not measured any more: {named}{_too_few(losses)}"] if losses.lost else []
    controls = result.controls
    if controls is not None and controls.kind == losses.kind and controls.lost:
        said.append(f"with nothing hidden, {len(controls.lost)} of {controls.n} not measured any more{_too_few(controls)}")
    return said + ([f"newly measured: {', '.join(losses.gained)}"] if losses.gained else [])


def lost_together(result: GateResult) -> list[str]:
    """What is measured no more of all kinds."""
    together = result.together
    if together is None or not together.lost:
        return []
    return [f"{together.kind}: {len(together.lost)} of {together.n} sequences not measured any more{_too_few(together)}"]


def _too_few(losses: Losses) -> str:
    return "" if losses.worse else ": too few to call it worse"


def places(result: GateResult, kind: str, out: Path) -> list[str]:
    """Where the sequences of a kind that got worse can be looked at."""
    named = result.sequences(kind) if result.verdict(kind) == "worse" else ()
    return [f"{name}: {file_of(kind, name, out)}" for name in named[:NAMED]]


def file_of(kind: str, name: str, out: Path) -> Path:
    """The page that shows a sequence, its estimate where there is no page, or a campaign's answer."""
    if kind == CAMPAIGNS:
        return answer_path(out / kind / ANSWERS, name)
    page = out / kind / REPORT / "report.html"
    return page if page.is_file() else estimate_path(out / kind / ESTIMATES, name)


def next_command(worse: tuple[str, str], out: Path) -> str:
    """What to type to see more of a sequence, given as kind and name, that got worse."""
    kind, name = worse
    if kind == CAMPAIGNS:
        return command("explain", campaign_folder(out / kind, name) / "observations")
    folder = out / kind
    return command("estimate", folder / DATASET / "observations" / name, "-v")


def document(result: GateResult, out: Path, cpu_s: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    """Everything as plain values."""
    return {
        "worse": result.worse,
        "failed": dict(result.failed),
        "false_alarms": FALSE_ALARMS,
        "decisions": result.decisions,
        "kinds": {
            losses.kind: {
                "verdict": result.verdict(losses.kind),
                "sequences": list(result.sequences(losses.kind)),
                "lost": list(losses.lost),
                "gained": list(losses.gained),
                "cpu_s": dict(zip(("now", "baseline"), cpu_s.get(losses.kind, ()), strict=False)),
                "measures": [_plain(each) for each in result.comparisons if each.kind == losses.kind],
            }
            for losses in result.losses
        },
        "sentences": sentences(result, out, cpu_s, every=False),
    }


def _plain(told: Comparison) -> dict[str, Any]:
    numbers = {"n": told.n, "ratio": told.ratio, "low": told.low, "high": told.high}
    return {"key": told.measure.key, **numbers, "verdict": told.verdict, "sequences": [list(each) for each in told.sequences]}


def _first_worse(result: GateResult) -> tuple[str, str] | None:
    named = ((losses.kind, result.sequences(losses.kind)) for losses in result.losses if result.verdict(losses.kind) == "worse")
    return next(((kind, names[0]) for kind, names in named if names), None)


def _times(cpu_s: tuple[float, float] | None) -> str:
    return "" if cpu_s is None else f", {cpu_s[0]:.0f} s of CPU time, the baseline's {cpu_s[1]:.0f} s"
