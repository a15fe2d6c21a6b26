"""The contact models' page says what its result file says, and every number in it is as close as asked."""

import json
from pathlib import Path

import numpy as np
import pytest

from datasets.errors import InputError
from estimator.contact.stronge_impulse import StrongeImpulse
from scripts.acceptance.contact_measured import QUANTITIES, by_impulse, fitted, predicted, read_measured
from scripts.acceptance.contact_reference import Row
from scripts.acceptance.contact_reference_page import PAGE, RESULT, page

STORED = json.loads(RESULT.read_text(encoding="utf-8"))


def test_the_page_is_copied_from_the_result_file() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(STORED)


def test_every_stored_number_is_as_close_as_asked() -> None:
    assert len(STORED["rows"]) > 80
    assert [row["name"] for row in STORED["rows"] if not row["off"] <= row["allowed"]] == []
    assert sum(row["lammps"] is not None for row in STORED["rows"]) == 28


def test_a_number_that_is_off_is_said_to_be() -> None:
    row = {**STORED["rows"][0], "kept": False}
    assert f"1 of {len(STORED['rows'])} numbers are not as close as asked" in page({**STORED, "rows": [row, *STORED["rows"][1:]]})
    assert not Row("group", "number", 1.0, 1.1, 0.05).kept
    assert Row("group", "number", 0.0, -5.0, 1e-9, absolute=True, at_most=True).kept
    assert not Row("group", "number", 0.0, 1e-8, 1e-9, absolute=True, at_most=True).kept


def test_sliding_measured_at_60_degrees_is_the_closed_form() -> None:
    for quantity, value in (("tangential_restitution", 0.895), ("rebound_spin_rad_per_s", 355.0)):
        np.testing.assert_allclose(predicted(quantity, 60.0), value, rtol=1e-3)


def test_constants_that_are_fitted_are_those_of_the_law_that_made_the_points() -> None:
    made = {q: np.array([[a, by_impulse(StrongeImpulse(0.96, 0.12), q, a)] for a in (20.0, 45.0)]) for q in QUANTITIES}
    impulse, compliant = fitted(made)
    assert abs(impulse.restitution[0] - 0.96) < 0.01
    assert abs(impulse.friction[0] - 0.12) < 0.002
    assert impulse.rms["rebound_spin_rad_per_s"] < 5.0 < compliant.rms["rebound_spin_rad_per_s"]


def test_the_stored_fits_leave_what_the_page_says() -> None:
    assert [f["model"] for f in STORED["fitted"]] == ["Mirtich–Stronge impulse", "Hertz–Mindlin, no slip"]
    for entry in STORED["fitted"]:
        assert 0.9 <= entry["restitution"][0] <= 1.0
        assert abs(entry["friction"][0] - 0.092) < 2.0 * entry["friction"][1]
        assert f"{entry['rms']['rebound_spin_rad_per_s']:.3g}" in page(STORED)


def test_a_file_that_is_no_measurement_is_refused(tmp_path: Path) -> None:
    source = tmp_path / "measured.csv"
    source.write_text("angle,value\n1,2\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"measured\.csv: expected the columns quantity, .*, got angle, value"):
        read_measured(source)
    source.write_text("quantity,incidence_angle_deg_from_normal,value\nheat,1,2\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"expected one of tangential_restitution, .*, got heat"):
        read_measured(source)
