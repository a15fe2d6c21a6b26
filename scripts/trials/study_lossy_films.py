"""What a lossy film costs: outlines of the same painted pictures from FFV1 of 12 bit (in 16), FFV1 of 8 bit, MJPEG and MPEG-4.

    python -m scripts.trials.study_lossy_films

Prints, for each, the RMS distance of outlines from those of the pictures themselves, along the normal, its part that neighbouring frames
share, and the noise of points that the outlines state for themselves. Half a minute.
"""

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from datasets.observation import Frames
from datasets.recipes.recipe import HsvRecipe, MotionRecipe, NoiseRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.video import open_video
from datasets.video.writing import write_film
from estimator.outlines import OutlineTrack, extract_outlines
from estimator.outlines.pictures.contour import outward_normals
from scripts.benchmarks.bench_estimate import painted
from synth.sequence import build_silhouette_sequence
from tumble.importing.clip import clip_of

RECIPE = Recipe(
    seed=5,
    particle=ParticleRecipe(irregularity=0.6, size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=40, speed_ms=(0.3, 0.8), spin_rads=(120.0, 200.0)),
    hsv=HsvRecipe(width_px=320, height_px=320, focal_mm=80.0),
    rig=RigRecipe(drops=1),
    noise=NoiseRecipe(hsv_boundary_px=0.0),
)
FORMS = (("FFV1, 12 bit", "FFV1", 16), ("FFV1, 8 bit", "FFV1", 8), ("MJPEG", "MJPG", 8), ("MPEG-4", "mp4v", 8))


def main() -> None:
    """Print the table."""
    observation, _ = build_silhouette_sequence(RECIPE, 0)
    rng = np.random.default_rng(1)
    pictures = [painted(outline, (320, 320), rng) for outline in observation.recordings[0]]  # type: ignore[union-attr, arg-type]
    exact: OutlineTrack | None = None
    print(f"{'film':<14} {'size (kB)':>9} {'off, RMS (px)':>14} {'shared with the next frame':>27} {'stated noise (px)':>18}")
    with tempfile.TemporaryDirectory() as folder:
        for name, codec, bits in FORMS:
            path = Path(folder) / f"film.{'mp4' if codec == 'mp4v' else 'avi'}"
            path.unlink(missing_ok=True)
            write_film(path, [picture >> (12 - bits) if bits == 8 else picture for picture in pictures], 30.0, bits=bits, codec=codec)
            clip: Frames = clip_of(open_video(path), (None, None), None)[0]
            track = extract_outlines(clip, name=name)
            exact = exact or track
            off = [displaced(a.outline.points_px, b.outline.points_px) for a, b in zip(exact.frames, track.frames, strict=True)]
            rms = float(np.sqrt(np.mean(np.concatenate(off) ** 2)))
            stated = float(np.nanmedian([frame.sigma_px for frame in track.frames]))
            print(f"{name:<14} {path.stat().st_size / 1e3:>9.0f} {rms:>14.4f} {shared(off):>27.2f} {stated:>18.4f}")


def displaced(exact: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance (n,) px of an outline's points from the nearest ones of ``exact`` along its normals."""
    normals = outward_normals(exact)
    near = cKDTree(exact).query(points)[1]
    return np.asarray(((points - exact[near]) * normals[near]).sum(axis=1))


def shared(off: list[NDArray[np.float64]]) -> float:
    """Correlation of the mean displacement of an outline with that of the next frame's."""
    means = np.array([each.mean() for each in off])
    return float(np.corrcoef(means[:-1], means[1:])[0, 1]) if np.ptp(means) > 0 else 0.0


if __name__ == "__main__":
    main()
