"""What ``tumble explain`` says of drops onto a plate beside effects: which flights are used, and what the contact lacks.

The contact is judged by the impacts that the estimates hold, made under the model that the effects of flight led to
(:mod:`estimator.contact_validation`); ``tumble validate-contact`` on the same folder shows all of it.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from datasets.errors import InputError
from datasets.estimate_files import read_estimate
from datasets.observation import Observation
from datasets.trajectory import Trajectory
from estimator.contact_validation.validate import LEAST_RUNS, Question, validate
from estimator.contact_validation.verdict import broken_verdict
from tumble.commands import command
from tumble.contact_validating import Known, collected_from
from tumble.diagnosing import ContactJudged
from tumble.result_files import estimate_path


def contact_judged(
    out: Path, drops: Sequence[Mapping[str, Any]], observations: Mapping[str, Observation | Trajectory], told: Callable[[str], None]
) -> ContactJudged:
    """Judge the contact by the estimates of ``drops`` in the folder ``out``."""

    def observation_of(name: str) -> Observation | None:
        found = observations[name]
        return found if isinstance(found, Observation) else None

    runs = ((read_estimate(estimate_path(out, str(each["recording"]))), observation_of) for each in drops)
    found = collected_from(runs, Known())
    used = len({impact.run for impact in found.impacts})
    broke = broken_verdict(found.broken, used + len(found.broken))
    if broke is not None:
        return ContactJudged(broke.sentence, broke.missing, None)
    if used < LEAST_RUNS:
        why = "; ".join(dict.fromkeys(found.left_out.values()))
        reason = f" ({why})" if why else ""
        return ContactJudged(
            f"Of the contact nothing is said: impacts of {used} recordings can be used, at least {LEAST_RUNS} are needed{reason}.", (), None
        )
    try:
        verdict = validate(found.impacts, Question(), told).verdict
    except InputError as error:
        return ContactJudged(f"Of the contact nothing is said: {error}", (), None)
    return ContactJudged(f"The contact, by {used} recordings: {verdict.sentence}", verdict.missing, command("validate-contact", out))
