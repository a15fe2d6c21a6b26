"""Small results through every door are what they were; see :mod:`tests.reference.golden_records` for how far they may move."""

from dataclasses import replace

import pytest

from tests.reference.golden import CORPUS, corpus, main, table
from tests.reference.golden_cases import CASES
from tests.reference.golden_records import SIGMA_SHARE, VALUE_SIGMAS, Record, differences

pytestmark = pytest.mark.long

MOST_BYTES = 200_000
KNOWN = Record({"status": "converged"}, {"v_x": (1.0, 0.01)}, {"rms": 0.3, "worth (nats)": 5.0})


@pytest.mark.parametrize("case", list(CASES))
def test_results_are_what_they_were(case: str) -> None:
    found = differences(case, corpus()[case], CASES[case]())
    assert not found, (
        "\n" + table(found) + "\nWhere this is meant: python -m tests.reference.golden --write, in a commit of its own that says why."
    )


def test_the_corpus_has_every_case_and_stays_small() -> None:
    assert list(corpus()) == list(CASES)
    assert CORPUS.stat().st_size < MOST_BYTES


@pytest.mark.parametrize(
    ("changed", "quantity"),
    [
        ({"facts": {"status": "ambiguous"}}, "status"),
        ({"numbers": {"v_x": (1.0 + 1.5 * VALUE_SIGMAS * 0.01, 0.01)}}, "v_x"),
        ({"numbers": {"v_x": (1.0, 0.01 * (1.0 + 1.5 * SIGMA_SHARE))}}, "v_x"),
        ({"numbers": {}}, "v_x"),
        ({"figures": {"rms": 0.306, "worth (nats)": 5.0}}, "rms"),
        ({"figures": {"rms": 0.3, "worth (nats)": 5.2}}, "worth (nats)"),
    ],
)
def test_what_moved_is_named(changed: dict[str, dict[str, object]], quantity: str) -> None:
    (found,) = differences("case", KNOWN, replace(KNOWN, **changed))
    assert found.quantity == quantity
    assert quantity in table([found])


def test_what_another_machine_does_passes() -> None:
    almost = Record(KNOWN.facts, {"v_x": (1.0 + 0.5 * VALUE_SIGMAS * 0.01, 0.01002)}, {"rms": 0.3001, "worth (nats)": 5.05})
    assert not differences("case", KNOWN, almost)


def test_the_command_says_that_nothing_moved(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--only", "gyroscope"]) == 0
    assert "results are what they were" in capsys.readouterr().out
