"""What the gate catches: ten faults must fail, ten harmless changes must pass, and so must runs with fresh noise.

``python -m scripts.gate.gate_demonstration --result docs/results/gate_demonstration.json --page docs/studies/gate.md``. The sequences are
those of the committed baseline. Every change (:mod:`scripts.gate.gate_changes`) is run in a process of its own on the kinds of sequences
where it acts; the rows of all other kinds are the baseline's, as the same code on the same sequences gives them. Fresh noise makes all
sequences anew; every realisation of the noise, the baseline's included, is then the baseline of every other one. Rows are kept in
``--out``, so a run that was killed goes on; it is refused, with the difference, where the baseline, the set or the sources have changed.
"""

import argparse
import json
import multiprocessing
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import permutations
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from datasets.atomic_files import written_whole
from datasets.dataset_files import observation_folder, read_dataset, truth_folder
from datasets.estimate import Estimate, Status
from datasets.file_digests import file_sha256
from datasets.json_documents import plain, revived
from datasets.observation_files import read_observation
from datasets.scoring.gate import CAMPAIGNS, Baseline, GateResult, compare, load_baseline
from datasets.scoring.gate_measures import Row, gate_row
from datasets.truth_files import read_truth
from estimator.data.configuration import configuration_from_dict
from estimator.measure import measure
from scripts.gate.gate_changes import FAULTS, HARMLESS, Change, fresh_noise
from scripts.gate.gate_demonstration_page import write_page
from tumble.challenge.answers import no_answer
from tumble.challenge.cases import campaign_folder
from tumble.challenge.field_case import read_field_cases
from tumble.challenge.scoring import NO_ANSWER, read_answer
from tumble.challenge.solving import solve_campaigns, solved
from tumble.cli.gate import set_file_of
from tumble.engine import Processes, Serial
from tumble.gate.campaigns import campaign_row, make_campaigns
from tumble.gate.sets import GateSet, read_set
from tumble.gate.words import sentences
from tumble.output_directory import Run, output_directory
from tumble.rendering import render_dataset
from tumble.versions import sources_digest, versions

UNCHANGED = Change("nothing", ())


@dataclass(frozen=True)
class Work:
    """Where rows are kept, and the set of sequences."""

    out: Path
    set_file: Path

    @property
    def gate_set(self) -> GateSet:
        """The set."""
        return read_set(self.set_file)

    def nature(self, kind: str, noise: int) -> Path:
        """The sequences of a kind with one realisation of the noise, made where they are not there."""
        folder = self.out / f"noise-{noise:02d}" / kind
        quietly: dict[str, Any] = {"executor": Serial(), "quiet": True}
        with fresh_noise(noise) if noise else _nothing():
            if kind == CAMPAIGNS:
                make_campaigns(self.gate_set.campaigns, folder, **quietly)
            else:
                render_dataset(self.gate_set.recipes[kind], folder, **quietly)
        return folder


def _nothing() -> Any:
    return UNCHANGED.patched()


def rows_of(kind: str, folder: Path, change: Change) -> list[Row]:
    """Rows of all sequences of a kind under one change; what raises has no numbers."""
    if kind != CAMPAIGNS:
        return [_estimated(kind, folder, name, change) for name in read_dataset(folder).sequences]
    if change.processes > 1:
        return _in_processes(folder, change)
    return [campaign_row(case, folder, _answered(campaign_folder(folder, case.name), change)) for case in read_field_cases(folder)]


def _estimated(kind: str, folder: Path, name: str, change: Change) -> Row:
    observation, truth = read_observation(observation_folder(folder, name)), read_truth(truth_folder(folder, name))
    with change.patched():
        try:
            estimate = measure(change.observed(observation), configuration_from_dict(dict(change.configuration)))
        except Exception as error:
            estimate = Estimate(name, Status.NO_CONVERGENCE, f"{type(error).__name__}: {error}")
    return gate_row(kind, estimate, truth)


def _answered(folder: Path, change: Change) -> dict[str, Any]:
    with change.patched():
        try:
            return dict(revived(json.loads(json.dumps(plain(solved(folder, dict(change.configuration)))))))
        except Exception as error:
            return no_answer([NO_ANSWER, f"{type(error).__name__}: {error}"])


def _in_processes(folder: Path, change: Change) -> list[Row]:
    with TemporaryDirectory() as answers:
        solve_campaigns(folder, dict(change.configuration), Path(answers), executor=Processes(change.processes), quiet=True)
        cases = read_field_cases(folder)
        return [campaign_row(case, folder, read_answer(Path(answers), case.name) or no_answer([NO_ANSWER])) for case in cases]


def kept_rows(work: Work, kind: str, noise: int, number: int | None) -> list[Row]:
    """Rows under a change (none: as it is), from where they are kept or worked out."""
    kept = work.out / "rows" / f"noise-{noise:02d}" / f"{'same' if number is None else f'{number:02d}'}-{kind}.json"
    if not kept.exists():
        began = time.process_time()
        change = UNCHANGED if number is None else (*FAULTS, *HARMLESS)[number]
        rows = rows_of(kind, work.nature(kind, noise), change)
        kept.parent.mkdir(parents=True, exist_ok=True)
        with written_whole(kept) as temporary:
            temporary.write_text(json.dumps(plain({"rows": rows, "cpu_s": time.process_time() - began})) + "\n", encoding="utf-8")
    found: list[Row] = revived(json.loads(kept.read_text(encoding="utf-8")))["rows"]
    return found


def in_own_process(work: Work, kind: str, noise: int, number: int | None) -> list[Row]:
    """The same, worked out in a process that ends with it: nothing that it replaced or remembered is left."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(kept_rows, work, kind, noise, number).result()


def judged(baseline: Baseline, changed: Mapping[str, Sequence[Row]], change: Change, out: Path) -> dict[str, Any]:
    """The gate's verdict on one change, and whether it is right."""
    found = compare(baseline, {**baseline.rows, **changed})
    is_fault = change in FAULTS
    return {
        "kind": "fault" if is_fault else "harmless",
        "change": change.name,
        "run_on": list(changed),
        "worse": found.worse,
        "right": found.worse == is_fault,
        "equal_to_the_digit": _is_equal(baseline, changed),
        "measures": [[one.kind, one.measure.words, one.ratio, one.low, one.high] for one in found.comparisons if one.verdict == "worse"],
        "lost": {losses.kind: list(losses.lost) for losses in found.losses if losses.lost},
        "sentences": _said(found, out),
    }


def _is_equal(baseline: Baseline, changed: Mapping[str, Sequence[Row]]) -> bool:
    pairs = [(old, new) for kind, rows in changed.items() for old, new in zip(baseline.rows[kind], rows, strict=True)]
    return all(plain({**new}) == plain({key: old[key] for key in new}) for old, new in pairs)


def _said(found: GateResult, out: Path) -> list[str]:
    return [line for line in sentences(found, out, {}, every=False) if not line.startswith(("next:", "  look at"))]


def fresh(baseline: Baseline, realisations: Sequence[Mapping[str, Sequence[Row]]]) -> dict[str, Any]:
    """How often one realisation of the noise is called worse than another, and how often a sequence is lost."""
    every = [baseline.rows, *realisations]
    first = [compare(baseline, rows) for rows in realisations]
    pairs = [compare(replace(baseline, rows=one), other) for one, other in permutations(every, 2)]
    measured = sum(bool(row["measured"]) for rows in every for kind in rows for row in rows[kind]) if realisations else 0
    lost = {kind: sum(len(losses.lost) for each in pairs for losses in each.losses if losses.kind == kind) for kind in baseline.rows}
    return {
        "realisations": len(every),
        "against_the_baseline": len(first),
        "alarms_against_the_baseline": sum(each.worse for each in first),
        "pairs": len(pairs),
        "alarms_of_pairs": sum(each.worse for each in pairs),
        "measured": measured,
        "sequences": sum(len(rows[kind]) for rows in every for kind in rows),
        "lost_of_pairs": lost,
        "share_lost": sum(lost.values()) / max(len(pairs) * sum(map(len, baseline.rows.values())), 1),
        "sentences": [_said(each, Path()) for each in pairs if each.worse],
    }


def main() -> int:
    """Run all; exit code 1 where the gate errs on a change or on fresh noise."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--baseline", type=Path, default=Path("baselines/quick.json"))
    parser.add_argument("--reruns", type=int, default=20, help="runs with fresh noise (default: %(default)s)")
    parser.add_argument("--only", default="", metavar="WORDS", help="changes whose name has these words in it, and no reruns")
    parser.add_argument("--out", type=Path, default=Path("out/gate_demonstration"), help="folder of the rows, kept to go on with")
    parser.add_argument("--force", action="store_true", help="begin from nothing")
    parser.add_argument("--result", type=Path, default=Path("out/gate_demonstration.json"))
    parser.add_argument("--page", type=Path, help="write the page, too")
    words = parser.parse_args()
    source, baseline = set_file_of(words.baseline), load_baseline(words.baseline)
    content = {"baseline": file_sha256(words.baseline), "set": read_set(source).content(), "sources": _sources()}
    run = Run("gate demonstration", json.loads(json.dumps(content)), reads=(words.baseline, source))
    resume = (words.out / "run.json").exists() and not words.force
    with output_directory(words.out, run, resume=resume, force=words.force) as out:
        work = Work(out.absolute(), source.absolute())
        changes = [_tried(work, baseline, number, words.only) for number in range(len(FAULTS) + len(HARMLESS))]
        reruns = 0 if words.only else words.reruns
        noises = [{kind: in_own_process(work, kind, noise, None) for kind in baseline.rows} for noise in range(1, reruns + 1)]
    result = {"environment": versions(), "changes": [each for each in changes if each], "fresh_noise": fresh(baseline, noises)}
    with written_whole(words.result) as temporary:
        temporary.write_text(json.dumps(plain(result), indent=1) + "\n", encoding="utf-8")
    if words.page:
        write_page(result, words.page)
    return 0 if all(each["right"] for each in result["changes"]) and not result["fresh_noise"]["alarms_against_the_baseline"] else 1


def _sources() -> str:
    return sources_digest(("datasets", "synth", "estimator", "tumble.challenge"))


def _tried(work: Work, baseline: Baseline, number: int, only: str) -> dict[str, Any] | None:
    change = (*FAULTS, *HARMLESS)[number]
    if only not in change.name:
        return None
    run = partial(in_own_process, work, noise=0, number=number)
    found = judged(baseline, {kind: run(kind) for kind in change.kinds}, change, work.out)
    said = "worse" if found["worse"] else "not worse"
    print(f"{found['kind']:9s} {change.name:50s} gate says {said:9s} {'right' if found['right'] else 'WRONG'}", flush=True)
    return found


if __name__ == "__main__":
    raise SystemExit(main())
