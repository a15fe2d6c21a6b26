"""Charts of what each sequence asks for: those of recordings name recordings, not their flights."""

from tumble.reports.sequence_charts import sequence_charts

RECORDINGS = ("first", "second", "third")
FLIGHTS = tuple(f"{name}, flight {k}" for name in RECORDINGS for k in (1, 2))


def value(sequence: str, amount: float) -> dict[str, object]:
    return {"effect": "uniform_acceleration", "parameter": "a_x", "sequence": sequence, "value": amount, "sigma": 0.1, "unit": "m/s2"}


def test_values_of_recordings_are_shown_against_recordings() -> None:
    values = [value(name, 0.1 * k) for k, name in enumerate(RECORDINGS)]
    chart = sequence_charts(values, FLIGHTS, RECORDINGS)["uniform_acceleration"]
    assert "second" in chart
    assert "flight" not in chart


def test_values_of_flights_are_shown_against_flights() -> None:
    values = [value(name, 0.1 * k) for k, name in enumerate(FLIGHTS)]
    assert "second, flight 2" in sequence_charts(values, FLIGHTS, RECORDINGS)["uniform_acceleration"]


def test_two_values_make_no_chart() -> None:
    assert sequence_charts([value(name, 0.1) for name in RECORDINGS[:2]], FLIGHTS, RECORDINGS) == {}
