"""``--known`` and ``--possible``: what a user states beside the recordings becomes facts about parameters of effects.

What can be stated is a number that lies on the user's desk:

- a length, known and measured (``length=100mm±0.2mm measured 98.0mm``; so ``distance``, ``diameter``, ``drop_height``, ``rest_height``, the
  last perhaps ``above`` a plane that is not at zero): the length scale, ``known / measured - 1``;
- ``rest_height=51.3mm±0.3mm`` alone, as recorded, where a mesh of the body says what it is;
- a checked clock, relative (``frame_rate=0±1e-5``) or in Hz; the size of gravity in m/s2;
- any parameter of an effect by its name (``gravity.dg_x=0±0.02m/s2``).
"""

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.vocabulary.effects import EFFECTS, of_camera, whose
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.campaign import Campaign
from estimator.fitting.campaigns.facts import Fact
from tumble.quantities import Quantity, quantity
from tumble.tracked_bodies import rest_heights

Array = NDArray[np.float64]
LENGTHS = ("length", "distance", "diameter", "width", "height", "drop_height", "rest_height")
BEYOND = 2.0
"""Plausible ranges beyond which a statement is taken for a wrong unit."""
EXACT = 1e-6
"""Of the step of a parameter, which moves what is measured visibly: what is known better than that is as good as exact."""
_PARTS = re.compile(r"\s*(.*?)(?:\s+measured\s+(.*?))?(?:\s+above\s+(.*?))?\s*")


@dataclass(frozen=True)
class Stated:
    """What one ``--known`` or ``--possible`` says.

    ``option`` with its ``words``; the ``name`` and what is ``known`` of it; of lengths what was ``measured``, above a ``plane``.
    """

    option: str
    words: str
    name: str
    known: Quantity
    measured: Quantity | None = None
    plane: Quantity | None = None

    @property
    def effect(self) -> str:
        """Key of the effect that it is about."""
        return "length_scale" if self.name in LENGTHS else self.parts[0]

    @property
    def parts(self) -> tuple[str, str]:
        """Key of the effect and its parameter, empty where none is named; the name of a camera may have dots."""
        effect, camera = whose(self.name)
        if not camera:
            key, _, parameter = self.name.partition(".")
            return key, parameter
        name, _, last = camera.rpartition(".")
        is_parameter = bool(name) and (effect not in EFFECTS or last in EFFECTS[effect].names)
        return (of_camera(effect, name), last) if is_parameter else (self.name, "")

    def refused(self, reason: str) -> InputError:
        """The error that names the statement."""
        return InputError(f"{self.option} {self.words!r}: {reason}.")


def known(words: str) -> Stated:
    """One ``--known``, ``NAME=VALUE±SIGMA``.

    Raises
    ------
    InputError
        With the statement, what was expected and what was given.
    """
    found = _stated("--known", words, "NAME=VALUE±SIGMA, as in 'length=100mm±0.2mm measured 98.0mm'")
    length = found.name in LENGTHS
    if not length and (found.measured is not None or found.plane is not None):
        raise found.refused(f"expected one number for {found.name}, since only lengths are both known and measured, got two")
    if found.plane is not None and (found.name != "rest_height" or found.measured is None):
        raise found.refused(f"expected 'above' after a measured rest_height alone, got it for {found.name}")
    given = [each for each in (found.known, found.measured, found.plane) if each is not None]
    units = [each.unit for each in given if each.unit != "m"]
    if length and units:
        raise found.refused(f"expected lengths in m, cm, mm or um, got {'no unit' if units[0] == '1' else units[0]}")
    if not max(each.sigma for each in given) > 0.0:
        raise found.refused("expected how sure it is, ±SIGMA after a number, got no standard deviation")
    return found


def possible(words: str) -> Stated:
    """One ``--possible``: an effect, perhaps its parameter, and its standard deviation about none, ``length_scale=±0.2%``.

    Raises
    ------
    InputError
        With the statement, what was expected and what was given.
    """
    form = "EFFECT=±SIGMA, as in length_scale=±0.2%"
    found = _stated("--possible", words, form)
    if found.known.value != 0.0 or not found.known.sigma > 0.0 or found.measured or found.plane or found.name in LENGTHS:
        raise found.refused(f"expected {form}, got {words!r}")
    return found


def _stated(option: str, words: str, form: str) -> Stated:
    name, equals, rest = words.partition("=")
    parts = _PARTS.fullmatch(rest)
    if not equals or not name.strip() or parts is None:
        raise InputError(f"{option} {words!r}: expected {form}, got {words!r}.")
    try:
        first, *others = (None if part is None else quantity(part) for part in parts.groups())
    except ValueError as error:
        raise InputError(f"{option} {words!r}: {error}.") from error
    assert first is not None
    return Stated(option, words, name.strip(), first, *others)


def facts_of(
    said: Sequence[Stated], campaign: Campaign, candidates: Mapping[str, EffectModel], mesh: Path | None = None
) -> tuple[Fact, ...]:
    """What statements mean to a campaign, in which only effects among the ``candidates`` can be.

    Raises
    ------
    InputError
        Where one is about nothing that such measurements have, or in units of something else.
    """
    return tuple(fact for each in said for fact in _facts(each, campaign, candidates, mesh))


def _facts(said: Stated, campaign: Campaign, candidates: Mapping[str, EffectModel], mesh: Path | None) -> tuple[Fact, ...]:
    model = _effect(said, campaign, candidates)
    sized, unit = [p for p in model.entry.parameters if p.name in model.entry.sizes], model.entry.parameters[0].unit
    known, weights = said.known, [_weights(model, (name,)) for name in _parameters(said, model)]
    if said.name in LENGTHS:
        known = _relative_length(said, mesh)
    elif said.name == "frame_rate" and known.unit == "Hz":
        known = _relative_rate(said, campaign)
    elif said.name == "gravity" and said.option == "--known":
        stated = _one_gravity(said, campaign)
        size = float(np.linalg.norm(stated))
        known, weights = Quantity(known.value - size, known.sigma, known.unit), [tuple((stated / size).tolist())]
    if known.unit != unit:
        raise said.refused(f"expected {_plain(unit)}, got {_plain(known.unit)}")
    most = BEYOND * max(abs(limit) for p in sized for limit in p.plausible)
    if abs(known.value) > most:
        raise said.refused(f"expected {said.effect} within ±{most:g} ({_plain(unit)}), got {known.value:.4g}")
    sigma = max(known.sigma, EXACT * min(p.step for p in sized))
    return tuple(Fact(said.words, ((said.effect, each),), known.value, sigma) for each in weights)


def _plain(unit: str) -> str:
    return "a number without unit or in %" if unit == "1" else unit


def _weights(model: EffectModel, names: Sequence[str]) -> tuple[float, ...]:
    return tuple(float(p.name in names) for p in model.entry.parameters)


def _effect(said: Stated, campaign: Campaign, candidates: Mapping[str, EffectModel]) -> EffectModel:
    """The effect that a statement is about."""
    if said.effect not in candidates:
        near = difflib.get_close_matches(said.effect, [*LENGTHS, *candidates], n=3, cutoff=0.5)
        offered = f"; did you mean {', '.join(near)}?" if near else ""
        raise said.refused(f"expected one of {', '.join(LENGTHS)}, or an effect of `tumble effect list`, got {said.effect!r}{offered}")
    model = candidates[said.effect]
    if model.entry.scope.own or model.random:
        raise said.refused(f"expected an effect with one value for all sequences, got {said.effect}, which differs in each")
    reason = campaign.kind.why_not(campaign, model)
    if reason is not None:
        raise said.refused(f"{said.effect} does not apply to these measurements: {reason}")
    return campaign.kind.adapted(model)


def _parameters(said: Stated, model: EffectModel) -> tuple[str, ...]:
    """The parameters that a statement is about: one, or each where an effect is possible."""
    (key, parameter), names = said.parts, model.entry.sizes
    if parameter in names:
        return (parameter,)
    if not parameter and (len(names) == 1 or said.option == "--possible" or key == "gravity"):
        return names
    raise said.refused(f"expected {' or '.join(f'{key}.{name}' for name in names)}, got {said.name}")


def _relative_length(said: Stated, mesh: Path | None) -> Quantity:
    """Known over measured length, minus 1."""
    known, measured = said.known, said.measured
    if measured is None and said.name == "rest_height" and mesh is not None:
        heights = rest_heights(mesh)
        known, measured = Quantity(float(heights[np.argmin(np.abs(heights - known.value))]), 0.0, "m"), known
    if measured is None:
        more = ", or --mesh, beside which the recorded one is enough" if said.name == "rest_height" else ""
        form = f"'{said.name}=100mm±0.2mm measured 98.0mm'"
        raise said.refused(f"expected what it is and what the recordings say, as in {form}{more}, got one number")
    if said.plane is not None:
        measured = Quantity(measured.value - said.plane.value, float(np.hypot(measured.sigma, said.plane.sigma)), "m")
    if min(known.value, measured.value) <= 0.0:
        raise said.refused(f"expected lengths above 0, got {known.value:g} m and {measured.value:g} m")
    ratio = known.value / measured.value
    return Quantity(ratio - 1.0, ratio * float(np.hypot(known.sigma / known.value, measured.sigma / measured.value)), "1")


def _relative_rate(said: Stated, campaign: Campaign) -> Quantity:
    """A frame rate in Hz over the nominal one, minus 1."""
    rates = [1.0 / sequence.setting.interval_s for sequence in campaign.sequences]
    nominal = float(np.median(rates))
    if np.ptp(rates) > said.known.sigma:
        raise said.refused(
            f"expected sequences of one nominal frame rate, got {min(rates):.6g} to {max(rates):.6g} Hz; state it relative to them, as in "
            "frame_rate=0±1e-5"
        )
    return Quantity(said.known.value / nominal - 1.0, said.known.sigma / nominal, "1")


def _one_gravity(said: Stated, campaign: Campaign) -> Array:
    """Gravity (3,) m/s² as all sequences state it."""
    vectors = [np.asarray(sequence.setting.gravity_world) for sequence in campaign.sequences]
    if not vectors[0].any() or any((g != vectors[0]).any() for g in vectors):
        raise said.refused("expected sequences with one stated gravity, got none or several; state gravity.dg_x and so on")
    return vectors[0]
