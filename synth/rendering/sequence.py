"""The rendered tier: one sequence of a recipe, from the plan to files.

Pictures are rendered one by one and kept until the sequence is whole (:mod:`synth.rendering.parts`), so a run that was killed
continues, with the same result to the last byte. Whatever of the sequence the recipe does not want rendered comes as exact outlines
with noise, from the silhouette tier.
"""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from datasets.dataset_files import observation_folder, truth_folder
from datasets.observation import Observation, Recording
from datasets.observation_files import write_observation
from datasets.recipes.recipe import Recipe
from datasets.recipes.several_cameras import filmed_by
from datasets.recipes.toml_files import recipe_to_dict
from datasets.tiff_frames import TiffFrames
from datasets.truth_files import write_truth
from synth.flight_bound import with_bound
from synth.plan import SequencePlan
from synth.plate_setting import plate_mesh
from synth.rendering.exposure import Optics, expose, film_of
from synth.rendering.materials import STEEL, material
from synth.rendering.parts import parts_of
from synth.rendering.recording import Taken, record_frames, record_masks, record_views
from synth.rendering.scene import ParticleModel
from synth.rendering.shooting import take
from synth.rendering.shots import FIRST, REMNANT, Shot, frame_shots, hsv_optics, rig_key, rig_optics, view_shots
from synth.rendering.tracer import Traced, Tracer, make_tracer
from synth.rendering.variant import activate, choose_variant
from synth.rendering.window import whole_picture
from synth.sequence import observation_of, outlines_by_camera, plan_sequence, truth_of, view_outlines
from synth.streams import streams_of

Advance = Callable[[int, int], None]
"""Told how many pictures are done, and of how many."""

PLATE_SAMPLES, PLATE_SEED = 32, 7
"""Rays per pixel of the plate without a particle, and their seed: as many as eight sub-frames have."""
PARTIAL = ".partial"
"""Where, in the dataset's folder, the finished pictures of unfinished sequences lie."""


def _silent(_done: int, _total: int) -> None:
    """Tell nobody."""


def render_sequence(recipe: Recipe, index: int, out: Path, *, advance: Advance = _silent, resume: bool = True) -> str:
    """Render sequence ``index`` of ``recipe`` into the dataset ``out``, observation and truth; return its name.

    Parameters
    ----------
    recipe, index
        What to render; with the variant they decide every bit of the result.
    out
        The dataset's folder.
    advance
        Called after every picture.
    resume
        Whether pictures that an earlier, unfinished run left are used.

    Raises
    ------
    InputError
        Where the recipe asks for what cannot be.
    TumbleError
        Where the disk does not take it.
    """
    plan = plan_sequence(recipe, index)
    variant = choose_variant(recipe.rendering.variant)
    mi = activate(variant)
    settings = {"recipe": recipe_to_dict(recipe), "index": index, "variant": variant, "mitsuba": mi.__version__}
    parts = parts_of(plan, settings, out / PARTIAL)
    if not resume:
        parts.remove()
    studio, rendered = Studio(mi, plan, recipe), recipe.tier == "rendered"
    taken = Taken(plan, recipe, index, parts, studio.empty() if rendered else None)
    cameras = [taken.by(number) for number in range(len(plan.by_camera))]
    frames = [tuple(frame_shots(each.plan, each.recipe, index, camera=each.camera)) for each in cameras] if rendered else []
    views = tuple(view_shots(plan, recipe, index)) if rig_is_rendered(recipe) else ()
    wanted = [*zip(cameras, frames, strict=False), (taken, views)]
    _render_missing(studio, [(each, shot) for each, shots in wanted for shot in shots], advance)
    observation, masks = _record(taken, frames, views, out)
    truth = truth_of(plan) if frames else with_bound(truth_of(plan), plan.hsv, recipe.noise)
    write_truth(dataclasses.replace(truth, masks=masks, notes={**truth.notes, "variant": variant}), truth_folder(out, plan.name))
    write_observation(observation, observation_folder(out, plan.name))
    parts.remove()
    return plan.name


def rig_is_rendered(recipe: Recipe) -> bool:
    """Whether the calibrated views are pictures."""
    return recipe.tier == "rendered" if recipe.rig.rendered is None else recipe.rig.rendered


def _render_missing(studio: "Studio", wanted: Sequence[tuple[Taken, Shot]], advance: Advance) -> None:
    for done, (taken, shot) in enumerate(wanted, start=1):
        if not taken.parts.has(shot):
            tracer, optics = studio.camera(shot.camera)
            taken.parts.store(shot, take(tracer, optics, shot, taken.plan.effects))
        advance(done, len(wanted))


class Studio:
    """The particle in front of every camera of a plan; a camera's scene is made when it is first asked for."""

    def __init__(self, mi: Any, plan: SequencePlan, recipe: Recipe) -> None:
        self._mi = mi
        surface = material(plan.material)
        self._flying = ParticleModel(plan.vertices, plan.faces, surface)
        rest = plan.vertices if plan.remnant is None else plan.remnant.mesh_vertices
        self._broken = ParticleModel(rest, plan.faces, surface)
        self._chip = None if plan.chip is None else ParticleModel(plan.chip.body.vertices, plan.chip.faces, surface)
        self._further = tuple(each.hsv.name for each in plan.further)
        self._seen_in_rig = ParticleModel(plan.view_vertices, plan.faces, surface)
        rig = rig_optics(plan, recipe)
        self._plate = plate_in_camera(plan)
        self._places: dict[str, tuple[Optics, Any]] = {
            each.hsv.name: (hsv_optics(each, filmed_by(recipe, number)), _middle(each)) for number, each in enumerate(plan.by_camera)
        }
        self._places[REMNANT] = self._places[FIRST]
        self._places |= {rig_key(k): (optics, np.array([0.0, 0.0, optics.lens.focus_m])) for k, optics in rig.items()}
        self._tracers: dict[str, Tracer] = {}

    def camera(self, key: str) -> tuple[Tracer, Optics]:
        """The tracer and the optics of a camera."""
        optics, at_cam = self._places[key]
        if key not in self._tracers:
            particle, plate, chip = self._bodies.get(key, (self._seen_in_rig, None, None))
            self._tracers[key] = make_tracer(self._mi, particle, film_of(optics), optics.light, at_cam, plate=plate, chip=chip)
        return self._tracers[key], optics

    @property
    def _bodies(self) -> dict[str, tuple[ParticleModel, ParticleModel | None, ParticleModel | None]]:
        """What is before the high-speed cameras: the particle, or its remnant and the chip, and the plate."""
        further = {name: (self._flying, None, None) for name in self._further}
        return {FIRST: (self._flying, self._plate, None), REMNANT: (self._broken, self._plate, self._chip), **further}

    def empty(self) -> Traced | None:
        """The plate's light and coverage in the whole picture of the high-speed camera; ``None`` without a plate."""
        if self._plate is None:
            return None
        optics, at_cam = self._places[FIRST]
        tracer = make_tracer(self._mi, self._plate, film_of(optics), optics.light, at_cam)
        pose = (np.eye(3), np.zeros(3))
        return expose(tracer, optics, whole_picture(optics.intrinsics), [pose], samples=PLATE_SAMPLES, seeds=[PLATE_SEED])


def _middle(plan: SequencePlan) -> Any:
    """Where (3,) m the particle is in the middle of a sequence, in its camera's frame."""
    return plan.hsv.R_cam_world @ plan.motion.x_world[len(plan.motion.times_s) // 2] + plan.hsv.t_cam_world


def plate_in_camera(plan: SequencePlan) -> ParticleModel | None:
    """The plate of a plan in the frame of the high-speed camera."""
    if plan.setting is None:
        return None
    vertices, faces = plate_mesh(plan.setting)
    return ParticleModel(vertices @ plan.hsv.R_cam_world.T + plan.hsv.t_cam_world, faces, STEEL)


def _record(taken: Taken, frames: Sequence[Sequence[Shot]], views: Sequence[Shot], out: Path) -> tuple[Observation, TiffFrames | None]:
    """The observation of the frames of every camera and of the views, and masks of the first camera's."""
    plan, recipe = taken.plan, taken.recipe
    folder = observation_folder(out, plan.name)
    stream = streams_of(recipe, taken.index)
    recordings: Sequence[Recording]
    view_recording: Recording
    if frames:
        recordings = [record_frames(taken.by(number), shots, folder) for number, shots in enumerate(frames)]
        masks = record_masks(taken, frames[0], truth_folder(out, plan.name))
    else:
        recordings, masks = outlines_by_camera(plan, recipe, taken.index), None
    if views:
        view_recording = record_views(taken, views, folder)
    else:
        view_recording = view_outlines(plan, recipe.noise, np.random.default_rng(stream.rig_noise))
    return observation_of(plan, recordings, view_recording), masks
