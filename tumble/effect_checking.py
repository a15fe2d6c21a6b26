"""Contract checks of one effect on a sequence at hand, or on one that is made up for it."""

import multiprocessing
import sys
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from datasets.errors import InputError, TumbleError
from datasets.observation import Observation
from datasets.observation_files import read_observation
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from estimator.appearance.effect_contracts import Kept, check_contracts
from estimator.data.configuration import Configuration
from estimator.effects.choosing import chosen_effects
from estimator.effects.link import EffectModel
from estimator.effects.plug_ins import is_plug_in
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.report_contracts import check_reports
from estimator.measurements.silhouettes.registration import register
from tumble.result_files import observations_in

RECIPE = Recipe(
    seed=5,
    particle=ParticleRecipe(irregularity=0.6, size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=16, speed_ms=(1.0, 2.0), spin_rads=(100.0, 200.0)),
    rig=RigRecipe(drops=2),
)


LIMIT_S = 120.0
"""Seconds that a check may take: some twenty times what it takes for an effect of the catalogue."""
START_S = 300.0
"""Seconds that a fresh process may take to start, and to have a sequence to check on; a busy machine takes its time."""
ENDS = "it ends, and leaves its process alone"


def check_effect(word: str, source: Path | None, limit_s: float = LIMIT_S) -> tuple[Kept, ...]:
    """The contracts of the effect that ``word`` names, on the first sequence of ``source`` or on a made-up one.

    A plug-in is checked in a process of its own, since it may end that process or never come to an end.

    Parameters
    ----------
    word
        A key of the catalogue, or ``FILE.py:CLASS``.
    source
        A dataset or observation.
    limit_s
        Seconds that a plug-in may take.

    Raises
    ------
    InputError
        Where there is no such effect, or the sequence cannot be measured.
    """
    apart = is_plug_in(word) and Path(word.rpartition(":")[0]).is_file()
    return _apart(word, source, limit_s) if apart else _checked(_one_effect(word), _sequence(source))


def _one_effect(word: str) -> EffectModel:
    (effect, *others) = chosen_effects(word)
    if others:
        raise InputError(f"{word}: expected one effect to check, got {1 + len(others)}.")
    return effect


def _sequence(source: Path | None) -> Registered:
    seen, tangents = _made_up() if source is None else read_observation(observations_in(source)[0]), Configuration(campaign_surface_fit=0)
    registered = register([seen], tangents)  # contracts are about tangency errors
    if registered.left_out:
        raise InputError(
            f"{registered.left_out[0].name}: cannot be measured, so nothing can be checked on it: {registered.left_out[0].reason}"
        )
    return registered


def _checked(effect: EffectModel, registered: Registered) -> tuple[Kept, ...]:
    sequence, flight = registered.campaign.sequences[0], registered.start.flights[0]
    return (*check_contracts(effect, sequence, flight), *check_reports(effect, sequence.setting, flight))


def _apart(word: str, source: Path | None, limit_s: float) -> tuple[Kept, ...]:
    """The contracts of a plug-in, checked in another process."""
    context = multiprocessing.get_context("spawn")
    answers, tells = context.Pipe(duplex=False)
    process = context.Process(target=_tell, args=(word, source, tells), daemon=True)
    process.start()
    tells.close()
    try:
        _answer(answers, START_S)
        try:
            _answer(answers, limit_s)
        except EOFError:
            raise InputError(f"{word}: expected an effect, got a file that ends its process while it is read.") from None
        except TimeoutError as error:
            raise InputError(f"{word}: expected an effect, got a file of which reading does not end: {error}.") from None
        _answer(answers, START_S)
        try:
            found: tuple[Kept, ...] = _answer(answers, limit_s)
        except EOFError:
            return (Kept(ENDS, False, "it ended the process that it ran in"),)
        except TimeoutError as error:
            return (Kept(ENDS, False, f"{error}: a link may loop for ever"),)
        return found
    finally:
        process.kill()
        process.join()


def _answer(answers: Connection, limit_s: float) -> Any:
    """What the other process tells next; what it raised is raised here."""
    if not answers.poll(limit_s):
        raise TimeoutError(f"no answer within {limit_s:g} s")
    told = answers.recv()
    if isinstance(told, Exception):
        raise told
    return told


def _tell(word: str, source: Path | None, tells: Connection) -> None:
    """In the other process: say when the plug-in is read, when the sequence is there, and what was found, or what was raised."""
    sys.stdout = sys.stderr  # what a plug-in prints is no result
    try:
        tells.send("started")
        effect = _one_effect(word)
        tells.send("the plug-in is read")
        registered = _sequence(source)
        tells.send("a sequence is there")
        tells.send(_checked(effect, registered))
    except TumbleError as error:
        tells.send(error)


def _made_up() -> Observation:
    """A short sequence of an irregular stone."""
    from synth.sequence import build_silhouette_sequence  # noqa: PLC0415 - only here is nature needed, and it takes a second to load

    return build_silhouette_sequence(RECIPE, 0)[0]
