"""Casting the rays of a thin lens through a window of an ideal film, on either of Mitsuba's kinds of variant.

Scalar variants use Mitsuba's own ``thinlens`` and ``hdrfilm`` with a crop; LLVM compiles the film's crop into its kernels, anew for
every place of the particle, so there the same rays are made here from values that kernels take as input. Both use a
box filter, since a pixel is the light that falls on its area. Where shading matters little, coverage is sampled with all rays and
radiance with a share of them.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from synth.rendering.camera import IdealFilm, camera_to_particle
from synth.rendering.light import Lighting
from synth.rendering.scene import (
    COVERAGE_ONLY,
    ParticleModel,
    Pose,
    Surroundings,
    integrator_dictionary,
    light_to_particle,
    positions_of_others,
    rays_per_shaded_one,
    scene_dictionary,
)
from synth.rendering.variant import drjit_module
from synth.rendering.window import Window

Array = NDArray[np.float64]

FILM_REACH_PX = 1 << 14
"""Half the width of the film that Mitsuba believes in; only windows of it are rendered."""
LARGEST_WAVEFRONT = 1 << 23
"""Rays at a time, which bounds memory."""


@dataclass(frozen=True)
class Traced:
    """``radiance`` that comes from the particle and ``coverage``, the share of each pixel that it covers, (height, width)."""

    radiance: Float[NDArray[np.float64], "height width"]
    coverage: Float[NDArray[np.float64], "height width"]


class Tracer(Protocol):
    """A scene and a film; poses, windows and seeds come with each call."""

    def trace(
        self, window: Window, R_cam_particle: Array, t_cam_particle: Array, *, samples: int, seed: int, chip: Pose | None = None
    ) -> Traced:
        """The particle at ``x_cam = R_cam_particle @ x + t_cam_particle`` (m), ``samples`` rays per pixel; ``chip``: where that is."""
        ...


def make_tracer(
    mi: Any,
    particle: ParticleModel,
    film: IdealFilm,
    light: Lighting,
    at_cam: Float[NDArray[np.float64], "3"],
    *,
    plate: ParticleModel | None = None,
    chip: ParticleModel | None = None,
) -> Tracer:
    """The tracer for the variant that is switched on; ``at_cam`` (m) is about where the particle is, ``plate`` in the camera frame.

    Where there is a plate, radiance and coverage are those of particle and plate together, and every ray is shaded, since steel mirrors.
    """
    kind = WavefrontTracer if mi.variant().startswith("llvm") else ScalarTracer
    return kind(mi, particle, film, Surroundings(light, at_cam, plate, chip))


def _rays_per_shaded_one(particle: ParticleModel, around: Surroundings) -> int:
    return rays_per_shaded_one(particle.material, around.light) if around.plate is None else 1


class ScalarTracer:
    """Mitsuba's thin lens, one ray after the other."""

    def __init__(self, mi: Any, particle: ParticleModel, film: IdealFilm, around: Surroundings) -> None:
        self._mi, self._film, self._around = mi, film, around
        self._rays_per_shaded_one = _rays_per_shaded_one(particle, around)
        self._coverage_only = mi.load_dict(COVERAGE_ONLY)
        centre = np.array([film.cx_px, film.cy_px]) + 0.5
        self._whole = np.rint(centre).astype(int)
        self._shear = tuple(-(centre - self._whole) / film.focal_px)
        scene = scene_dictionary(mi, particle, around)
        scene["integrator"] = integrator_dictionary(around.depth(particle.material))
        scene["sensor"] = {
            "type": "thinlens",
            "fov_axis": "x",
            "fov": float(np.degrees(2 * np.arctan(FILM_REACH_PX / film.focal_px))),
            "aperture_radius": film.lens.aperture_radius_m,
            "focus_distance": film.lens.focus_m,
            "near_clip": 1e-3,
            "film": {
                "type": "hdrfilm",
                "width": 2 * FILM_REACH_PX,
                "height": 2 * FILM_REACH_PX,
                "crop_width": 1,
                "crop_height": 1,
                "pixel_format": "luminance_alpha",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "multijitter", "sample_count": 4},
        }
        self._scene = mi.load_dict(scene)
        self._parameters = mi.traverse(self._scene)

    def trace(
        self, window: Window, R_cam_particle: Array, t_cam_particle: Array, *, samples: int, seed: int, chip: Pose | None = None
    ) -> Traced:
        """See :class:`Tracer`."""
        mi, parameters = self._mi, self._parameters
        corner = np.array([window.x0, window.y0]) + FILM_REACH_PX - self._whole
        parameters["sensor.film.crop_size"] = mi.ScalarVector2u(window.width, window.height)
        parameters["sensor.film.crop_offset"] = mi.ScalarPoint2u(*corner.tolist())
        camera = camera_to_particle(R_cam_particle, t_cam_particle, shear=self._shear)
        parameters["sensor.to_world"] = mi.ScalarTransform4f(camera)
        parameters["light.to_world"] = mi.ScalarTransform4f(light_to_particle(R_cam_particle))
        for name, positions in positions_of_others(self._around, (R_cam_particle, t_cam_particle), chip).items():
            parameters[name] = positions
        parameters.update()
        shaded = np.array(mi.render(self._scene, seed=seed, spp=max(1, samples // self._rays_per_shaded_one)), dtype=np.float64)
        if self._rays_per_shaded_one == 1:
            return Traced(shaded[:, :, 0], shaded[:, :, 1])
        covered = np.array(mi.render(self._scene, integrator=self._coverage_only, seed=seed, spp=samples), dtype=np.float64)
        return Traced(shaded[:, :, 0], covered[:, :, 1])


class WavefrontTracer:
    """All rays of a window at once."""

    def __init__(self, mi: Any, particle: ParticleModel, film: IdealFilm, around: Surroundings) -> None:
        self._mi, self._film, self._around = mi, film, around
        self._rays_per_shaded_one = _rays_per_shaded_one(particle, around)
        self._coverage_only = mi.load_dict(COVERAGE_ONLY)
        self._scene = mi.load_dict(scene_dictionary(mi, particle, around))
        self._integrator = mi.load_dict(integrator_dictionary(around.depth(particle.material)))
        self._parameters = mi.traverse(self._scene)

    def trace(
        self, window: Window, R_cam_particle: Array, t_cam_particle: Array, *, samples: int, seed: int, chip: Pose | None = None
    ) -> Traced:
        """See :class:`Tracer`."""
        mi = self._mi
        self._parameters["light.to_world"] = mi.Transform4f(mi.ScalarTransform4f(light_to_particle(R_cam_particle)))
        for name, positions in positions_of_others(self._around, (R_cam_particle, t_cam_particle), chip).items():
            self._parameters[name] = mi.Float(positions)
        self._parameters.update()
        to_world = camera_to_particle(R_cam_particle, t_cam_particle, shear=(0.0, 0.0))
        rows = max(1, LARGEST_WAVEFRONT // (samples * window.width))
        strips = [
            Window(window.x0, y0, window.width, min(rows, window.y0 + window.height - y0))
            for y0 in range(window.y0, window.y0 + window.height, rows)
        ]
        parts = [self._strip(strip, to_world, samples, seed + strip.y0) for strip in strips]
        return Traced(np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts]))

    def _strip(self, strip: Window, to_world: Array, samples: int, seed: int) -> tuple[Array, Array]:
        """Radiance and coverage of a strip of the window."""
        radiance, covered = self._cast(self._integrator, strip, to_world, max(1, samples // self._rays_per_shaded_one), seed)
        if self._rays_per_shaded_one > 1:
            _, covered = self._cast(self._coverage_only, strip, to_world, samples, seed)
        return radiance, covered

    def _cast(self, integrator: Any, strip: Window, to_world: Array, samples: int, seed: int) -> tuple[Array, Array]:
        mi, dr = self._mi, drjit_module()
        sampler = mi.load_dict({"type": "multijitter", "sample_count": samples})
        per_pixel = int(sampler.sample_count())
        sampler.set_samples_per_wavefront(per_pixel)
        sampler.seed(seed % 2**32, strip.width * strip.height * per_pixel)
        spectrum, seen, _ = integrator.sample(self._scene, sampler, self._rays(sampler, strip, per_pixel, to_world))
        radiance = mi.Float(spectrum.x) if mi.is_monochromatic else mi.luminance(spectrum)
        covered = dr.select(seen, mi.Float(1), mi.Float(0))
        dr.eval(radiance, covered)
        radiance, covered = (np.array(dr.block_sum(lanes, per_pixel), dtype=np.float64) for lanes in (radiance, covered))
        shape = (strip.height, strip.width)
        return radiance.reshape(shape) / per_pixel, covered.reshape(shape) / per_pixel

    def _rays(self, sampler: Any, strip: Window, per_pixel: int, to_world: Array) -> Any:
        """Rays in the order of pixels; what changes from call to call is opaque, so that kernels are compiled once."""
        mi, dr, film = self._mi, drjit_module(), self._film
        lane = dr.arange(mi.UInt32, strip.width * strip.height * per_pixel) // dr.opaque(mi.UInt32, per_pixel)
        row = lane // dr.opaque(mi.UInt32, strip.width)
        column = lane - row * dr.opaque(mi.UInt32, strip.width)
        jitter = sampler.next_2d()
        u = mi.Float(column) + jitter.x + dr.opaque(mi.Float, strip.x0 - 0.5 - film.cx_px)
        v = mi.Float(row) + jitter.y + dr.opaque(mi.Float, strip.y0 - 0.5 - film.cy_px)
        focus = dr.opaque(mi.Float, film.lens.focus_m)
        scale = focus * dr.opaque(mi.Float, 1 / film.focal_px)
        disk = mi.warp.square_to_uniform_disk_concentric(sampler.next_2d()) * dr.opaque(mi.Float, film.lens.aperture_radius_m)
        origin = mi.Vector3f(-disk.x, -disk.y, 0)
        direction = dr.normalize(mi.Vector3f(-u * scale, -v * scale, focus) - origin)
        turn, place = mi.Matrix3f(to_world[:3, :3]), mi.Vector3f(*to_world[:3, 3].tolist())
        dr.make_opaque(turn, place)
        return mi.Ray3f(mi.Point3f(turn @ origin + place), turn @ direction)
