"""The page of the gate's demonstration, from its result."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from datasets.atomic_files import written_whole
from datasets.scoring.gate import FALSE_ALARMS

HEAD = """# What the gate catches

Written by `python -m scripts.gate.gate_demonstration --result docs/results/gate_demonstration.json --page docs/studies/gate.md` from
[its result](../results/gate_demonstration.json). Ten faults are put into the estimator, one at a time, as programming mistakes would be;
ten changes are harmless. Each is run on the kinds of sequences where it acts, and compared with the committed baseline as `tumble gate`
does it; the other kinds have the baseline's rows.
"""


def write_page(result: Mapping[str, Any], path: Path) -> None:
    """Write the page."""
    with written_whole(path) as temporary:
        temporary.write_text(page(result), encoding="utf-8")


def page(result: Mapping[str, Any]) -> str:
    """The page, as Markdown."""
    changes, noise = result["changes"], result["fresh_noise"]
    faults, harmless = ([each for each in changes if each["kind"] == kind] for kind in ("fault", "harmless"))
    caught, passed = sum(each["worse"] for each in faults), sum(not each["worse"] for each in harmless)
    verdict = f"**{caught} of {len(faults)} faults are caught, {passed} of {len(harmless)} harmless changes pass.**"
    lines = [HEAD, f"{verdict} {_noise(noise)}", ""]
    lines += ["| fault | run on | gate says | by |", "| --- | --- | --- | --- |", *(_line(each, _by(each)) for each in faults), ""]
    lines += ["| harmless change | run on | gate says | |", "| --- | --- | --- | --- |"]
    lines += [_line(each, "equal to the last digit" if each["equal_to_the_digit"] else _by(each)) for each in harmless]
    return "\n".join(lines) + "\n"


def _noise(noise: Mapping[str, Any]) -> str:
    if noise["realisations"] < 2:
        return ""
    stated = f"{FALSE_ALARMS:.0%} at most is what the gate states"
    alarms = f"{noise['alarms_against_the_baseline']} of {noise['against_the_baseline']}"
    said = f"With fresh noise on the same sequences {alarms} runs are called"
    pairs = f"worse than the baseline, and {noise['alarms_of_pairs']} of the {noise['pairs']} ordered pairs of {noise['realisations']}"
    lost = f"realisations ({stated}; pairs share realisations). Noise alone loses {noise['share_lost']:.2%} of sequences."
    return f"{said}\n{pairs} {lost}"


def _line(each: Mapping[str, Any], by: str) -> str:
    return f"| {each['change']} | {', '.join(each['run_on'])} | {'worse' if each['worse'] else 'not worse'} | {by} |"


def _by(each: Mapping[str, Any]) -> str:
    measures = [f"{kind}: {words} {ratio:.2f} ({low:.2f} to {high:.2f})" for kind, words, ratio, low, high in each["measures"]]
    return "; ".join([*measures, *(f"{kind}: {len(names)} not measured any more" for kind, names in each["lost"].items())])
