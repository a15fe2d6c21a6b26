"""No committed result is older than the code that it says it depends on, and no page is older than its result."""

from pathlib import Path

import pytest

from studies.frame.command import TOGETHER, committed
from studies.frame.digests import of_modules
from studies.frame.pages import drawn_from_digest, picture_path, text_of
from studies.frame.results import read_result
from studies.frame.study import Study
from studies.pages import uncertainty
from studies.registry import STUDIES
from studies.reporting.figures import drawn_from
from studies.reporting.words import page_text
from tumble.versions import versions

DOCS = Path(__file__).resolve().parents[2] / "docs"
COMMITTED = [study for study in STUDIES if (DOCS / "results" / f"{study.name}.json").is_file()]
by_name = pytest.mark.parametrize("study", COMMITTED, ids=lambda study: study.name)


@by_name
def test_rows_are_of_the_plan_as_it_is(study: Study) -> None:
    result = read_result(study.name, DOCS / "results")
    assert dict(result.sources) == of_modules(study.plan.modules), f"measure anew: python -m studies {study.name} --docs docs"


@by_name
def test_rows_are_of_this_release(study: Study) -> None:
    assert read_result(study.name, DOCS / "results").versions["tumble"] == versions()["tumble"]


@by_name
def test_page_and_picture_are_of_the_rows(study: Study) -> None:
    result, pages = read_result(study.name, DOCS / "results"), DOCS / "studies"
    assert (pages / f"{study.name}.md").read_text(encoding="utf-8") == text_of(study, result), (
        f"python -m studies {study.name} --page --docs docs"
    )
    assert drawn_from(picture_path(study.name, pages)) == drawn_from_digest(study, result)


def test_the_page_over_all_is_of_the_rows() -> None:
    text = page_text(uncertainty.page(committed(STUDIES, DOCS / "results")))
    assert (DOCS / "studies" / TOGETHER).read_text(encoding="utf-8") == text, "python -m studies --together --docs docs"


def test_every_other_result_is_one_of_those_from_before_the_frame() -> None:
    framed = {f"{study.name}{suffix}" for study in COMMITTED for suffix in (".json", ".csv")}
    assert {path.name for path in (DOCS / "results").iterdir()} - framed == set(BEFORE_THE_FRAME)


BEFORE_THE_FRAME = """
acceptance_contact.json
acceptance_contact_chip.json
acceptance_impacts.json
acceptance_rendered_drops.json
bench_crop.json
bench_report.json
challenge_261.json
challenge_52.json
contact_reference.json
detection_limits.json
drops_by_samples.json
drops_challenge.json
drops_challenge_cases.csv
drops_challenge_impacts.csv
field_challenge.json
field_challenge_100.json
first_recording.json
free_focal.json
gate_demonstration.json
hull_leaks.json
real_impacts.json
real_outlines.json
real_tosses.json
sizes_at_spikes.json
study_calibration.json
study_separation.json
study_shape.json
tutorial.json
two_particles.json
wrong_poses.json
""".split()
"""Results that carry no digest of what made them. May only shrink: a study that is made anew is moved into the frame, or goes."""
