"""``tumble cluster``: a Dask scheduler with workers, for ``--scheduler`` of other verbs."""

import argparse
import signal
import sys
import threading
from pathlib import Path

from tumble.cli.exit_codes import ALL_MEASURED
from tumble.cli.options import verb_parser
from tumble.engine.cluster import job_script, read_cluster, started
from tumble.written_files import refuse_other_file


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "cluster",
        description="Start a Dask scheduler here, and its workers as FILE.toml says: through Slurm, PBS, SGE, LSF, OAR, Moab or HTCondor,\n"
        "or as local processes. It stays until Ctrl-C; meanwhile other verbs work there with --scheduler scheduler.json\n"
        "(docs/cluster.md).",
        example="tumble cluster cluster.toml --dry-run",
    )
    verb.add_argument("plan", type=Path, metavar="FILE.toml", help="system, workers and the options of a job")
    verb.add_argument("--dry-run", action="store_true", help="print the script of one job and start nothing")
    verb.add_argument(
        "--scheduler-file",
        type=Path,
        default=Path("scheduler.json"),
        metavar="FILE",
        help="where to say where it is (default: %(default)s)",
    )
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Show the job, or stay until Ctrl-C."""
    plan = read_cluster(arguments.plan)
    if arguments.dry_run:
        print(job_script(plan))
        return ALL_MEASURED
    refuse_other_file(arguments.scheduler_file, '"address"', "--scheduler-file")
    with started(plan, arguments.scheduler_file) as cluster:
        if not arguments.quiet:
            said = f"scheduler {cluster.scheduler_address}, {plan.workers} workers asked for; Ctrl-C ends them all"
            print(f"tumble: {said}\nnext: tumble estimate OBSERVATIONS --scheduler {arguments.scheduler_file}", file=sys.stderr, flush=True)
        signal.signal(signal.SIGTERM, signal.default_int_handler)  # `kill`, as of a batch script, ends it like Ctrl-C
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            return ALL_MEASURED
    return ALL_MEASURED
