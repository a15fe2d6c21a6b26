"""``tumble estimate`` of trajectories that strike something: each is measured by itself, as free flights with impacts between them."""

import argparse
from collections.abc import Callable

from datasets.estimate import Estimate
from datasets.estimate_files import read_estimate
from tumble.cli.campaign_options import question_of, read_by
from tumble.cli.outcomes import tell_left_out
from tumble.estimating_impacts import estimate_impacts, trajectories_with_impacts
from tumble.output_directory import Run, note_failures, output_directory
from tumble.result_files import SUFFIX, estimate_path


def estimate_with_impacts(arguments: argparse.Namespace, tell: Callable[[argparse.Namespace, list[Estimate]], int]) -> int | None:
    """Measure and print; ``None`` where no trajectory strikes anything. Exit code 1 when one has no measurement."""
    question = question_of(arguments)
    trajectories, left_out = trajectories_with_impacts(question.source, question.known)
    if not trajectories:
        return None
    content = {"observations": str(question.source.resolve()), "impacts": True, "known": question.known.words}
    described = Run("estimate", content, reads=read_by(arguments))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        if not all(estimate_path(out, t.name).exists() for t in trajectories):
            estimate_impacts(trajectories, out)
        tell_left_out(left_out)
        note_failures(out, left_out)
    return max(tell(arguments, [read_estimate(path) for path in sorted(arguments.out.glob(f"*{SUFFIX}"))]), int(bool(left_out)))
