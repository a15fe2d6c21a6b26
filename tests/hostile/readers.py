"""Every reader that is attacked: the files it takes, which of them are spoiled and how, and a call that reads all of it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from datasets.array_files import read_arrays
from datasets.camera_files import read_camera, read_gravity
from datasets.dataset_files import read_dataset
from datasets.estimate_files import read_estimate
from datasets.json_documents import read_document
from datasets.observation_files import read_observation
from datasets.outline_files import read_outlines
from datasets.particle_files import ParticleFile, read_particle
from datasets.plumb_files import read_plumb_points
from datasets.recipes.toml_files import load_recipe
from datasets.rig_files.opening import Convention, read_rig
from datasets.scoring.gate import load_baseline
from datasets.tiff_frames import TiffFrames
from datasets.trajectory_files import read_trajectory
from datasets.truth_files import read_truth
from datasets.video import open_video
from estimator.particle.made_once import made_of_arrays
from synth.particles.mesh_import import read_mesh as import_mesh
from tests.hostile import valid_files
from tests.hostile.mutations import ARCHIVE, BYTES, JSON, TEXT, Mutation
from tests.hostile.valid_files import BITS, HEIGHT, PICTURES, WIDTH
from tumble.configuring import load_configuration
from tumble.tracked_bodies import read_mesh as tracked_mesh


@dataclass(frozen=True)
class Reader:
    """``write`` makes the valid files of a folder, ``file`` is spoiled by one of ``mutations``, ``read`` reads the folder."""

    name: str
    write: Callable[[Path], None]
    file: str
    mutations: tuple[Mutation, ...]
    read: Callable[[Path], object]


def _stack(name: str) -> Reader:
    def read(folder: Path) -> None:
        frames = TiffFrames(folder / name, BITS, folder / name)
        frames.check(PICTURES, WIDTH, HEIGHT, 'camera "hsv"')
        for k in range(len(frames)):
            frames.read(k)
        frames.background()

    return Reader(name, valid_files.pictures, name, BYTES, read)


def _video(file: str, mutations: tuple[Mutation, ...] = BYTES, folder: str = "") -> Reader:
    """A recording in the file that is spoiled, or in the ``folder`` of pictures that it is in."""

    def read(root: Path) -> None:
        video = open_video(root / (folder or file))
        for k in range(video.header.count):
            video.read(k)

    return Reader(folder or file, valid_files.videos, file, mutations, read)


def _masks(folder: Path) -> None:
    masks = read_truth(folder).masks
    if masks is not None:
        for k in range(len(masks)):
            masks.read(k)


def _document(name: str) -> Reader:
    return Reader(name, valid_files.documents, name, JSON, lambda folder: read_document(folder / name, name.removesuffix(".json")))


def _made_arrays(folder: Path) -> None:
    path = folder / "made.npz"
    made_of_arrays(read_arrays(path, valid_files.MADE), str(path))


def _made(particle: ParticleFile) -> None:
    if particle.made is not None:
        particle.made.load(particle.made.of)


OUTLINES = "outlines_left.npz"


def _mesh(suffix: str, read: Callable[[Path], object]) -> Reader:
    return Reader(f"stone{suffix}", valid_files.meshes, f"stone{suffix}", BYTES if suffix != ".obj" else TEXT, read)


def _rig(name: str, mutations: tuple[Mutation, ...]) -> Reader:
    """A rig of another program."""
    return Reader(f"rig {name}", valid_files.rigs, name, mutations, lambda folder: read_rig([folder / name], Convention(size=(640, 480))))


READERS = (
    Reader("observation.json", valid_files.observation, "observation.json", JSON, read_observation),
    Reader("outlines.npz", valid_files.observation, OUTLINES, ARCHIVE, lambda folder: read_outlines(folder / OUTLINES)),
    _stack("none.tif"),
    _stack("deflate.tif"),
    _stack("tiles.tif"),
    _stack("packbits.tif"),
    Reader("toss.csv", valid_files.texts, "toss.csv", TEXT, lambda folder: read_trajectory(folder / "toss.csv", {})),
    Reader("toss.tum", valid_files.texts, "toss.tum", TEXT, lambda folder: read_trajectory(folder / "toss.tum", {})),
    Reader("trajectory.toml", valid_files.texts, "trajectory.toml", TEXT, lambda folder: read_trajectory(folder / "toss.csv", {})),
    Reader("estimate.json", valid_files.estimate, "e.json", JSON, lambda folder: read_estimate(folder / "e.json")),
    Reader("truth.json", valid_files.truth, "truth.json", JSON, _masks),
    Reader("motion.npz", valid_files.truth, "motion.npz", ARCHIVE, read_truth),
    Reader("mesh.ply", valid_files.truth, "mesh.ply", BYTES, read_truth),
    _mesh(".ply", lambda folder: (import_mesh(folder / "stone.ply"), tracked_mesh(folder / "stone.ply"))),
    _mesh(".stl", lambda folder: import_mesh(folder / "stone.stl", repair=True)),
    _mesh(".obj", lambda folder: import_mesh(folder / "stone.obj", repair=True)),
    Reader("recipe.toml", valid_files.texts, "recipe.toml", TEXT, lambda folder: load_recipe(folder / "recipe.toml")),
    Reader("configuration.toml", valid_files.texts, "configuration.toml", TEXT, lambda f: load_configuration(f / "configuration.toml", [])),
    Reader("dataset.json", valid_files.documents, "dataset.json", JSON, read_dataset),
    Reader("baseline.json", valid_files.documents, "baseline.json", JSON, lambda folder: load_baseline(folder / "baseline.json")),
    *(_video(f"drop_{bits}.cine") for bits in (8, 10, 12, 16)),
    *(_video(f"drop_{bits}.mraw") for bits in (8, 12, 16)),
    _video("drop_12.cih", TEXT),
    _video("drop_xml.cihx", (*TEXT, *BYTES)),
    *(_video(f"{name}.tif") for name in ("lzw", "zstd", "jpeg")),
    *(_video(f"{name}.avi") for name in ("ffv1_8", "ffv1_16", "mjpg")),
    _video("film.mp4"),
    *(_video(f"{name}/1{suffix}", folder=name) for name, suffix in valid_files.IMAGES.items()),
    Reader("camera.toml", valid_files.texts, "camera.toml", TEXT, lambda folder: read_camera(folder / "camera.toml")),
    Reader("camera.json", valid_files.texts, "camera.json", JSON, lambda folder: read_camera(folder / "camera.json")),
    Reader("gravity.toml", valid_files.texts, "gravity.toml", TEXT, lambda folder: read_gravity(folder / "gravity.toml")),
    *(_rig(name, mutations) for name, mutations in valid_files.RIGS.items()),
    Reader("calibration.json", valid_files.rigs, "calibration.json", JSON, lambda folder: read_camera(folder / "calibration.json")),
    Reader("particle.json", valid_files.particle, "particle.json", JSON, lambda folder: _made(read_particle(folder))),
    Reader("made.npz", valid_files.particle, "made.npz", ARCHIVE, _made_arrays),
    Reader("plumb.csv", valid_files.rigs, "plumb.csv", TEXT, lambda folder: read_plumb_points(folder / "plumb.csv")),
    _document("campaign.json"),
    _document("diagnosis.json"),
)
