"""``tumble estimate --effects``: all observations of a folder fitted jointly, with effects in the model."""

import argparse
import json
from collections.abc import Callable

from datasets.estimate import Estimate, Status
from datasets.estimate_files import read_estimate
from datasets.json_documents import plain, read_document
from estimator.fitting.side_by_side import processes
from tumble.cli.campaign_options import campaign_of, described_effects, question_of, read_by, values_table
from tumble.cli.console import console
from tumble.cli.outcomes import what_next
from tumble.diagnosing import CAMPAIGN_FILE, estimated
from tumble.limiting import facts_told
from tumble.output_directory import Run, output_directory
from tumble.result_files import SUFFIX

SHOWN = ("effects", "values", "settled", "rms_ete_px", "unit", "left_out", "facts", "limits")
"""Parts of ``campaign.json`` that ``--json`` prints."""


def estimate_campaign(arguments: argparse.Namespace, tell: Callable[[argparse.Namespace, list[Estimate]], int]) -> int:
    """Fit and print; exit code 1 when a sequence was left out or has no measurement."""
    question = question_of(arguments)
    content = {"observations": str(arguments.observations.resolve()), **described_effects(question), **question.configuration}
    described = Run("estimate", content, reads=read_by(arguments))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        if not (out / CAMPAIGN_FILE).exists():
            with processes(arguments.jobs), campaign_of(question, out, quiet=arguments.quiet) as campaign:
                estimated(question, campaign, out)
    document = read_document(arguments.out / CAMPAIGN_FILE, "campaign")
    estimates = [read_estimate(path) for path in sorted(arguments.out.glob(f"*{SUFFIX}"))]
    code = tell(arguments, estimates)
    if arguments.json:
        print(json.dumps(plain({key: document[key] for key in SHOWN if key in document})))
    elif not arguments.quiet:
        if document["values"]:
            console().print(values_table(document["values"]))
        limits = [document["limits"]["sentence"]] if document.get("limits") else []
        for sentence in (*facts_told(document.get("facts", ())), *limits):
            console().print(sentence, soft_wrap=True)
        then = question.command("diagnose", ()) if any(e.status is Status.CONVERGED for e in estimates) else None
        console().print(what_next(then), soft_wrap=True)
    return max(code, int(bool(document["left_out"])))
