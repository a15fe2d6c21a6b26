"""A scheduler with workers, made from one TOML file: through Slurm or another batch system (by dask-jobqueue), or of local processes.

``system`` names the batch system, ``workers`` how many processes there shall be; ``[job]`` is what dask-jobqueue calls the options of one
job: ``cores``, ``memory``, ``walltime``, ``queue``, ``account``, ``job_script_prologue`` and so on. Every process has one thread.
"""

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.toml_text import read_toml
from tumble.engine.scheduler import import_distributed
from tumble.one_thread import keep_to_one_thread

LOCAL = "local"
SYSTEMS: Mapping[str, str] = {
    "slurm": "SLURMCluster",
    "pbs": "PBSCluster",
    "sge": "SGECluster",
    "lsf": "LSFCluster",
    "oar": "OARCluster",
    "moab": "MoabCluster",
    "htcondor": "HTCondorCluster",
}
"""Batch systems, and what dask-jobqueue calls them."""
ANY_ADDRESS = "tcp://SCHEDULER:PORT"
"""Stands in a job script that is only shown: no scheduler is started for that."""


@dataclass(frozen=True)
class ClusterPlan:
    """What a cluster file says."""

    system: str
    workers: int
    job: dict[str, Any] = field(default_factory=dict)


def read_cluster(path: Path) -> ClusterPlan:
    """The plan in a file.

    Raises
    ------
    InputError
        Where something is missing, unknown or of another kind.
    """
    table = read_toml(path)
    unknown = sorted(set(table) - {"system", "workers", "job"})
    if unknown:
        raise InputError(f"{path}: expected system, workers and [job], got {', '.join(unknown)}.")
    system, workers, job = table.get("system"), table.get("workers", 1), table.get("job", {})
    if system not in (LOCAL, *SYSTEMS):
        raise InputError(f"{path}: system: expected one of {', '.join((LOCAL, *SYSTEMS))}, got {system!r}.")
    if not isinstance(workers, int) or isinstance(workers, bool) or workers < 1:
        raise InputError(f"{path}: workers: expected a whole number of at least 1, got {workers!r}.")
    if not isinstance(job, dict) or (job and system == LOCAL):
        raise InputError(f"{path}: job: expected options of the jobs of a batch system, got {job!r}.")
    return ClusterPlan(system, workers, job)


def job_script(plan: ClusterPlan) -> str:
    """The script of one job, as it would be handed to the batch system; nothing is started.

    Raises
    ------
    InputError
        Where the plan has no jobs, or options that the batch system does not know.
    """
    if plan.system == LOCAL:
        raise InputError(f"system {LOCAL!r}: expected a batch system to show the job script of, got local processes.")
    try:
        return str(_cluster_class(plan).job_cls(scheduler=ANY_ADDRESS, name="tumble", **_options(plan)).job_script())
    except (TypeError, ValueError) as error:
        raise InputError(f"[job]: expected options of a job that dask-jobqueue knows, but {error}") from error


@contextmanager
def started(plan: ClusterPlan, scheduler_file: Path) -> Iterator[Any]:
    """Start a scheduler and ask for its workers; ``scheduler_file`` says where it is, for ``--scheduler``. All end with the block."""
    keep_to_one_thread(os.environ)
    with _cluster(plan) as cluster:
        with written_whole(scheduler_file) as temporary:
            temporary.write_text(json.dumps({"address": cluster.scheduler_address}) + "\n", encoding="utf-8")
        try:
            yield cluster
        finally:
            scheduler_file.unlink(missing_ok=True)


def _cluster(plan: ClusterPlan) -> Any:
    distributed = import_distributed()
    if plan.system == LOCAL:
        return distributed.LocalCluster(n_workers=plan.workers, threads_per_worker=1, dashboard_address=":0")
    job_script(plan)  # refuses what is wrong in the plan before anything is started
    kind = _cluster_class(plan)
    submit = kind.job_cls.submit_command.split()[0]
    if shutil.which(submit) is None:
        raise InputError(f"system {plan.system!r}: expected its command {submit} on this machine, got none. Start on a login node.")
    cluster = kind(scheduler_options={"dashboard": False}, **_options(plan))
    cluster.scale(plan.workers)
    return cluster


def _options(plan: ClusterPlan) -> dict[str, Any]:
    """The options of a job, with as many processes as cores."""
    return {**plan.job, "processes": plan.job.get("cores", 1), "cores": plan.job.get("cores", 1)}


def _cluster_class(plan: ClusterPlan) -> Any:
    try:
        import dask_jobqueue  # noqa: PLC0415 - only runs that start jobs need it
    except ImportError as error:
        raise InputError(f'system {plan.system!r} needs dask-jobqueue, which is not installed: pip install "tumble[cluster]".') from error
    return getattr(dask_jobqueue, SYSTEMS[plan.system])
