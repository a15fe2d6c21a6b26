"""A whole estimate of 100 frames and 60 views on one core, pose search included, and the memory of 1000 frames of 512 x 512.

``python -m scripts.benchmarks.bench_estimate --json`` or ``tumble bench --only estimate``; about a minute. Time is processor time of one
thread, the better of two runs after a first, which may compile the kernel and is given apart. Memory is the peak resident size of a
process of its own that only reads and estimates, interpreter and libraries included. Its pictures (12 bit) are painted, not traced:
exact outlines, each pixel's covered area, blur and sensor noise. (Outlines that carry the silhouette tier's boundary noise already must
not be painted: no optics makes such an edge, its roughness does not fit the stated noise, no candidate trajectory is then good enough
to stop the search, and the estimate takes five times as long.)
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from tumble.one_thread import keep_to_one_thread

keep_to_one_thread(os.environ)

import cv2  # noqa: E402 - after the threads are limited
import numpy as np  # noqa: E402

from datasets.observation import Observation, Recording  # noqa: E402
from datasets.observation_files import frames_file, read_observation, write_observation  # noqa: E402
from datasets.recipes.recipe import HsvRecipe, MotionRecipe, NoiseRecipe, Recipe  # noqa: E402
from datasets.tiff_frames import FrameStackWriter, TiffFrames  # noqa: E402
from datasets.vocabulary.outline import Outline  # noqa: E402
from estimator.data.configuration import Configuration  # noqa: E402
from estimator.measuring.free_flight import estimate  # noqa: E402
from synth.sequence import build_silhouette_sequence  # noqa: E402

MOTION = MotionRecipe(frames=100, speed_ms=(1.0, 2.0), spin_rads=(100.0, 200.0))
LONG_MOTION = MotionRecipe(frames=1000, frame_rate_hz=40000.0, speed_ms=(0.2, 0.5), spin_rads=(100.0, 200.0))
LONG_CAMERA = HsvRecipe(width_px=512, height_px=512, exposure_us=10.0)
LONG = Recipe(seed=5, motion=LONG_MOTION, hsv=LONG_CAMERA, noise=NoiseRecipe(hsv_boundary_px=0.0))
BRIGHT, DARK, BIT_DEPTH, NOISE_DN = 3200, 200, 12, 12.0
FINER, SUBPIXEL_BITS, BLUR_PX, MARGIN_PX = 8, 6, 0.6, 6
"""Pictures are drawn eight times as large and averaged, so that an edge lies where the outline does to a few hundredths of a pixel."""


def seconds_of_an_estimate() -> tuple[float, float]:
    """Seconds of the first run (compiling included) and of the better of two later ones."""
    observation, _ = build_silhouette_sequence(Recipe(seed=5, motion=MOTION), 0)
    return _timed(observation), min(_timed(observation), _timed(observation))


def _timed(observation: Observation) -> float:
    cv2.setNumThreads(1)
    began = time.process_time()
    estimate(observation, Configuration())
    return time.process_time() - began


def painted(outline: Outline, size: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """A picture (height, width) of a dark silhouette before a bright background: each pixel's covered area, blurred, with noise."""
    low = np.maximum(np.floor(outline.points_px.min(axis=0)).astype(int) - MARGIN_PX, 0)
    high = np.minimum(np.ceil(outline.points_px.max(axis=0)).astype(int) + MARGIN_PX + 1, size[::-1])
    fine = np.zeros((high - low)[::-1] * FINER, dtype=np.uint8)
    corners = ((outline.points_px - low + 0.5) * FINER - 0.5) * (1 << SUBPIXEL_BITS)
    cv2.fillPoly(fine, [np.round(corners).astype(np.int32)], 255, shift=SUBPIXEL_BITS)
    covered = cv2.GaussianBlur(cv2.resize(fine, (high - low).tolist(), interpolation=cv2.INTER_AREA) / 255.0, (0, 0), BLUR_PX)
    picture = BRIGHT + rng.normal(scale=NOISE_DN, size=size)
    picture[low[1] : high[1], low[0] : high[0]] -= (BRIGHT - DARK) * covered
    return np.clip(np.round(picture), 0, (1 << BIT_DEPTH) - 1).astype(np.uint16)


def as_pictures(observation: Observation, folder: Path, rng: np.random.Generator) -> None:
    """Write ``observation`` into ``folder`` with its one recording of outlines painted as pictures."""
    (camera,), (outlines,) = observation.cameras, observation.recordings
    size = (camera.intrinsics.height_px, camera.intrinsics.width_px)
    path = folder / frames_file(camera.name)
    with FrameStackWriter(path) as writer:
        for k in range(len(outlines)):
            writer.append(painted(outlines[k], size, rng))
    stack: Recording = TiffFrames(path, BIT_DEPTH)
    fields = {**vars(observation), "recordings": (stack,)}
    write_observation(Observation(**fields), folder)


def long_recording(folder: Path) -> dict[str, Any]:
    """What a process needs that estimates 1000 frames of 512 x 512 and does nothing else, see :func:`cost_of`."""
    observation, _ = build_silhouette_sequence(LONG, 0)
    as_pictures(observation, folder, np.random.default_rng(LONG.seed))
    command = [sys.executable, "-m", "scripts.benchmarks.bench_estimate", "--cost-of", str(folder)]
    cost: dict[str, Any] = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    return cost


def cost_of(folder: Path) -> dict[str, Any]:
    """Estimate the observation in ``folder``: peak memory (GB) of this process, processor time (s) and the status."""
    cv2.setNumThreads(1)
    began = time.process_time()
    status = estimate(read_observation(folder), Configuration()).status
    unit = 1.0 if sys.platform == "darwin" else 1024.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e9
    return {"peak_gb": peak, "seconds": time.process_time() - began, "status": status.value}


def figures() -> list[dict[str, Any]]:
    """Every figure with its unit and, where there is one, its limit."""
    first, later = seconds_of_an_estimate()
    with tempfile.TemporaryDirectory() as folder:
        cost = long_recording(Path(folder))
    long = f"1000 frames of 512 x 512 ({cost['status']})"
    return [
        {"name": "whole estimate, 100 frames x 60 views", "value": later, "unit": "s of one core", "limit": 8.0, "direction": "lower"},
        {"name": "the same, first run (kernel compiled or loaded)", "value": first, "unit": "s of one core"},
        {"name": f"peak memory, {long}", "value": cost["peak_gb"], "unit": "GB", "limit": 1.0, "direction": "lower"},
        {"name": f"whole estimate, {long}", "value": cost["seconds"], "unit": "s of one core"},
    ]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--cost-of", type=Path, metavar="FOLDER", help="estimate this observation alone and print what it took")
    words = parser.parse_args()
    print(json.dumps(cost_of(words.cost_of) if words.cost_of else figures()))
