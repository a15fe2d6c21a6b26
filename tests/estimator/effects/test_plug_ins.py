"""Effects of users' own: what is wrong with one is said with its file, parameters and frame."""

from pathlib import Path

import numpy as np
import pytest

from datasets.errors import InputError
from estimator.diagnosis.adding import with_effect
from estimator.effects.choosing import chosen_effects
from estimator.effects.model import overrides
from estimator.effects.plug_ins import STAGES, load_plug_in
from tests.estimator.small_campaign import fitted, registered

HEAD = """
import numpy as np
from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage
from estimator.effects.link import BodyChange, EffectModel

def entry(key="wind", name="push", unit="m/s2", plausible=(-5.0, 5.0), step=1e-3, stage=Stage.DYNAMICS):
    return EffectEntry(key, stage, Scope.CAMPAIGN, (Parameter(name, unit, plausible, step, "size"),), "a push along x", "none")

def spoilt(**changes):
    # as it can be written where nothing checks types
    made = entry()
    for name, value in changes.items():
        object.__setattr__(made if hasattr(made, name) else made.parameters[0], name, value)
    return made
"""
WIND = '''
class Wind(EffectModel):
    """A steady push along x."""
    entry = entry()
    def acceleration(self, theta, moment, setting):
        return theta * np.array([1.0, 0.0, 0.0])
'''


def plug_in(folder: Path, body: str) -> str:
    path = folder / "my_wind.py"
    path.write_text(HEAD + body, encoding="utf-8")
    return f"{path}:Wind"


def link(name: str, arguments: str, answer: str) -> str:
    entry = f"entry(stage=Stage.{STAGES[name][0].name})"
    return f"class Wind(EffectModel):\n    entry = {entry}\n    def {name}(self, {arguments}):\n        {answer}\n"


def test_a_plug_in_is_an_effect_like_others(tmp_path: Path) -> None:
    effect = load_plug_in(plug_in(tmp_path, WIND))
    assert effect.entry.key == "wind"
    assert overrides(effect, "acceleration")
    assert not overrides(effect, "torque", "times", "shift")
    _, fit = with_effect(registered().campaign, fitted(), effect)
    assert fit.model.keys[-1] == "wind"
    assert abs(fit.state.theta[0][-1]) < 2.0, "nothing pushes in these recordings"


@pytest.mark.parametrize(
    ("body", "parts"),
    [
        ("raise = 3", ("raised SyntaxError", "while it was read")),
        ("Wind = 3", ("expected a class 'Wind'", "no effect at all")),
        ("class Wand(EffectModel):\n    entry = entry()\n", ("expected a class 'Wind'", "its effects: Wand")),
        ("class Wind:\n    entry = entry()\n", ("has not EffectModel among its bases",)),
        ("class Wind(EffectModel):\n    pass\n", ("has not an entry",)),
        ("class Wind(EffectModel):\n    entry = 'wind'\n", ("expected entry to be an EffectEntry", "got str")),
        ("class Wind(EffectModel):\n    entry = entry()\n", ("expected one of the links", "got none")),
        (WIND.replace("entry()", "entry(key='gravity')"), ('its key "gravity" is that of an effect of the catalogue',)),
        (WIND.replace("entry()", "entry(key='offset')"), ('its key "offset" is what parameters of a flight are called',)),
        (WIND.replace("entry()", "entry(step=0.0)"), ("parameter push: expected a step above 0",)),
        (WIND.replace("entry()", "entry(plausible=(1.0, 1.0))"), ("parameter push: expected a plausible range",)),
        (
            WIND.replace("entry()", "spoilt(stage='dynamics')"),
            ("expected stage of its entry to be a Stage, one of", "'dynamics'"),
        ),
        (WIND.replace("entry()", "entry(stage=Stage.CLOCK)"), ("expected Stage.DYNAMICS, where acceleration() acts, got Stage.CLOCK",)),
        (WIND.replace("entry()", "spoilt(scope='campaign')"), ("expected scope of its entry to be a Scope, one of SEQUENCE",)),
        (WIND.replace("entry()", "spoilt(plausible=5.0)"), ("expected a step and a plausible range of numbers",)),
        (WIND.replace("entry()", "spoilt(step='1')"), ("expected a step and a plausible range of numbers",)),
        (WIND.replace("entry()", "spoilt(key=3)"), ("expected key of its entry to be a str, got 3",)),
        ("import sys\nsys.exit(0)", ("raised SystemExit (0)", "while it was read")),
        (WIND + "    def __init__(self):\n        raise SystemExit\n", ("raised SystemExit", "when it was made")),
        (WIND + "    def __init__(self, size):\n        pass\n", ("raised TypeError", "an effect is made without arguments")),
    ],
)
def test_what_is_no_effect_is_refused_when_it_is_loaded(tmp_path: Path, body: str, parts: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as refused:
        load_plug_in(plug_in(tmp_path, body))
    assert [part for part in (str(tmp_path / "my_wind.py"), *parts) if part not in str(refused.value)] == [], str(refused.value)


@pytest.mark.parametrize(
    ("body", "parts"),
    [
        (
            link("acceleration", "theta, moment, setting", "raise ValueError('no air here')"),
            ("raised ValueError (no air here)", "acceleration()", "push = ", "m/s2", "at frame "),
        ),
        (
            link("acceleration", "theta, moment, setting", "return np.where(moment.time_s > 3e-3, np.nan, theta) * np.ones(3)"),
            ("acceleration() gave a number that is not finite", "push = ", "at frame 1"),
        ),
        (
            link("acceleration", "theta, moment, setting", "return theta[0]"),
            ("expected acceleration() to give an array of shape", "got (1,)", "push = ", "at frame "),
        ),
        (
            link("torque", "theta, moment, setting", "return 'strong'"),
            ("expected torque() to give numbers, got str", "push = ", "at frame "),
        ),
        (link("delays", "theta, rows_px", "return rows_px[1:]"), ("expected delays() to give an array of shape", "push = ")),
        (
            link("delays", "theta, rows_px", "return np.nan * rows_px"),
            ("delays() gave a number that is not finite", "push = ", "in outline 0"),
        ),
        (
            link("times", "theta, setting, times_s", "return times_s[1:]"),
            ("expected times() to give an array of shape (30,), got (29,) with push = ", "frames 0 to 29"),
        ),
        (
            link("times", "theta, setting, times_s", "return np.where(np.arange(30) == 7, np.inf, times_s)"),
            ("times() gave a number that is not finite", "at frame 7"),
        ),
        (link("body", "theta, setting", "return theta"), ("expected body() to give a BodyChange, got ndarray with push = ",)),
        (
            link("body", "theta, setting", "return BodyChange(np.zeros(3), np.full(5, np.nan))"),
            ("body() gave a number that is not finite",),
        ),
        (link("scale", "theta", "return -1.0"), ("expected scale() above 0, got -1", "push = ")),
        (
            link("correct", "theta, points_px, camera, times_s", "return np.where(times_s[:, None] > 4e-3, np.nan, points_px)"),
            ("correct() gave a number that is not finite", "in picture 17"),
        ),
        (
            link("shift", "theta, places, setting", "return np.zeros(3)"),
            ("expected shift() to give an array of shape", "got (3,) with push = ", "frames 0 to "),
        ),
        (
            link(
                "shift",
                "theta, places, setting",
                "return np.where(places.times_s[:, None, None] > 5e-3, np.nan, 0.0) + 0 * places.radius_px",
            ),
            ("shift() gave a number that is not finite", "at frame 2"),
        ),
    ],
)
def test_a_link_that_misbehaves_is_named(tmp_path: Path, body: str, parts: tuple[str, ...]) -> None:
    word = plug_in(tmp_path, body)
    with pytest.raises(InputError) as refused:
        with_effect(registered().campaign, fitted(), load_plug_in(word))
    assert [part for part in (word, *parts) if part not in str(refused.value)] == [], str(refused.value)


def test_integers_and_lists_are_numbers(tmp_path: Path) -> None:
    body = link("acceleration", "theta, moment, setting", "return [[0, 0, 0]] * len(theta)")
    effect = load_plug_in(plug_in(tmp_path, body))
    found = registered()
    with_effect(found.campaign, fitted(), effect)


def test_a_plug_in_stands_beside_the_catalogue(tmp_path: Path) -> None:
    effects = chosen_effects(f"magnus_lift, {plug_in(tmp_path, WIND)}")
    assert [e.entry.key for e in effects] == ["magnus_lift", "wind"]
    assert np.array_equal(effects[1].starts(registered().campaign.sequences[0].setting), np.zeros((1, 1)))
