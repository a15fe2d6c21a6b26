"""What would tell two effects apart, in a sentence."""

from estimator.diagnosis.separation import Expected, Prospect, Separation
from tumble.reports.separation_words import advised, separation_sentence
from tumble.reports.verdict import Verdict

MARGIN = 3.0


def prospect(key: str, drops: int, difference: float, probability: float) -> Prospect:
    return Prospect(key, f"a {key} drop", drops, 30, Expected(difference, probability))


def test_the_sentence_names_what_would_and_what_would_not() -> None:
    told = Separation(
        ("linear_drag", "quadratic_drag"),
        MARGIN,
        Expected(0.4, 0.0),
        (prospect("faster", 1, 31.0, 0.99), prospect("calm", 1, 25.0, 0.96), prospect("similar", 4, 1.25, 0.0)),
    )
    sentence = separation_sentence(told)
    assert sentence == (
        "Linear drag or quadratic drag (expected difference of log likelihoods now 0.4, more than 3 is needed): a faster drop (31) or "
        "a calm drop (25) would tell them apart; 4 times a similar drop (1.2) would not."
    )


def test_where_nothing_helps_the_sentence_says_so() -> None:
    told = Separation(("blooming", "outline_offset"), MARGIN, Expected(0.1, 0.0), (prospect("faster", 4, 3.0, 0.1),))
    assert "no recording on trial would tell them apart; the best, 4 times a faster drop (3.0), would not do." in separation_sentence(told)


def test_effects_that_contradict_each_other_are_never_advised_together() -> None:
    told = Separation(("frame_rate", "length_scale"), MARGIN, Expected(0.0, 0.0), (prospect("second", 1, 50.0, 1.0),))
    assert separation_sentence(told).endswith("Either way only one of them can be in a model.")
    verdict = advised(Verdict("found", "Frame rate.", ("First.",), ("frame_rate",)), [told], "tumble diagnose data")
    assert verdict.add == ("frame_rate",)
    assert verdict.remarks == ("First.", separation_sentence(told), "With the new recording in the same folder: tumble diagnose data")
