"""A reason that struck many is said once, whatever numbers it has in it."""

from tumble.reasons import grouped


def test_reasons_that_differ_in_names_and_numbers_are_told_together() -> None:
    reasons = {f"toss_{k:02d}.csv": f"in/toss_{k:02d}.csv: expected metres, got {70.5 + k} m at 1.{k}e+03 m/s" for k in range(12)}
    told = grouped({**reasons, "other.csv": "in/other.csv: expected gravity, got none"})
    assert [why for _, why in told] == [reasons["toss_00.csv"], "in/other.csv: expected gravity, got none"]
    assert told[0][0].startswith("12 of them (toss_00.csv, toss_01.csv, ")
    assert told[0][0].endswith(" and 4 more)")
