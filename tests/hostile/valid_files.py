"""Small valid files of every format that a reader takes, to be spoiled."""

import json
import shutil
import struct
from pathlib import Path

import cv2
import numpy as np
import tifffile
import trimesh
from PIL import Image
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from datasets.calibration_files import write_calibration
from datasets.dataset_files import Dataset, write_dataset
from datasets.estimate_files import write_estimate
from datasets.json_documents import write_document
from datasets.observation import CalibratedView, Companion, Observation
from datasets.observation_files import write_observation
from datasets.particle_files import ParticleFile, write_particle
from datasets.recipes.recipe import EffectRecipe, PlateRecipe, Recipe
from datasets.recipes.toml_files import recipe_to_toml
from datasets.tiff_frames import FrameStackWriter, TiffFrames
from datasets.truth_files import write_truth
from datasets.video.phantom_table import LINEAR_DN
from datasets.video.writing import Recorded, write_cine, write_film, write_mraw
from datasets.vocabulary.calibration import Calibration, CalibrationFit, CrossValidation
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.clock import Clock
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.plate import Plate
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.particle.made_once import MadeOnce, arrays_of
from estimator.poses.pose_starts import StartCatalogue
from tests.datasets.conftest import make_estimate, make_truth, square_outline
from tests.datasets.test_measured_entries import impact_at, with_impact
from tests.datasets.test_rig_files import P_of, model
from tests.datasets.test_rig_files import cameras as rig_cameras
from tests.hostile.mutations import BYTES, TEXT

ROOT = Path(__file__).resolve().parents[2]
WIDTH, HEIGHT, PICTURES = 24, 20, 3
BITS = 12


RIGS = {
    **dict.fromkeys(("p.npy", "p.mat", "zipped.mat", "cells.mat"), BYTES),
    **dict.fromkeys(("p.csv", "dlt.csv", "pair.yml", "one.cameramodel"), TEXT),
}
"""Rigs of other programs, and how they are spoiled."""


def rigs(folder: Path) -> None:
    """Rigs in the files of other programs, a calibration, points of a plumb line."""
    true = rig_cameras()
    stacked = np.stack([P_of(camera) for camera in true])
    np.save(folder / "p.npy", stacked)
    np.savetxt(folder / "p.csv", stacked.reshape(-1, 4), delimiter=",")
    np.savetxt(folder / "dlt.csv", np.stack([(P / P[2, 3]).ravel()[:11] for P in stacked], axis=1), delimiter=",")
    savemat(folder / "p.mat", {"P1": stacked[0], "P2": stacked[1]})
    savemat(folder / "zipped.mat", {"P": np.moveaxis(stacked, 0, 2)}, do_compression=True)
    cells = np.empty((1, 2), dtype=object)
    cells[0, :] = list(stacked)
    savemat(folder / "cells.mat", {"P": cells})
    storage = cv2.FileStorage(str(folder / "pair.yml"), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 640)
    storage.write("image_height", 480)
    for k, camera in enumerate(true, start=1):
        storage.write(f"M{k}", camera.intrinsics.K)
        storage.write(f"D{k}", np.array([[-0.1, 0.02, 0.0, 0.0, 0.0]]))
    storage.write("R", true[1].R_cam_world)
    storage.write("T", true[1].t_cam_world)
    storage.release()
    (folder / "one.cameramodel").write_text(model(true[0]), encoding="utf-8")
    check = CrossValidation(9.0, 9, 0.4, True, 1.0)
    fit = CalibrationFit(0.03, 800, 12, 1, check)
    calibration = Calibration(tuple(true), np.eye(24), fit, "chessboard:9x6:5mm", np.array([0.0, 9.8, 0.1]), 1e-4 * np.eye(3), ("a note",))
    write_calibration(calibration, folder / "calibration.json")
    (folder / "plumb.csv").write_text("camera,line,x_px,y_px\n1,1,10.5,20\n2,1,11,22.25\n", encoding="utf-8")


MADE = (
    *("cast_offsets", "cast_points", "catalogue_middle", "catalogue_r", "catalogue_support", "convex_vertices", "hollow"),
    *("hull_faces", "hull_vertices"),
)
"""Arrays of a body without hollows."""


def particle(folder: Path) -> None:
    """A particle file with what was made once."""
    intrinsics = Intrinsics(WIDTH, HEIGHT, 600.0, 600.0, 11.5, 9.5)
    views = tuple(CalibratedView(intrinsics, np.eye(3), np.array([0.0, 0.0, 1.2]), k, k) for k in range(2))
    hull = SurfaceMesh(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]))
    ring = square_outline(10, 9, 4.0)
    made = MadeOnce(
        hull, StartCatalogue(np.eye(3)[None], np.ones((1, 72)), np.zeros((1, 2))), 0.0, None, hull.vertices, (ring.points_px,) * 2
    )
    write_particle(ParticleFile("stone", views, (ring, ring), 1e-3, {"settled": True}), folder, ("ab" * 32, arrays_of(made)))


def observation(folder: Path) -> None:
    """Outlines of two cameras, a plate, a second particle."""
    intrinsics = Intrinsics(WIDTH, HEIGHT, 600.0, 600.0, 11.5, 9.5, (0.01, 0.0, 0.0, 0.0, 0.0), 20e-6)
    moving = tuple(square_outline(8 + 0.2 * k, 9, 3.0) for k in range(PICTURES))
    turned = [Rotation.from_rotvec([0, k, 0]).as_matrix() for k in range(2)]
    views = tuple(CalibratedView(intrinsics, R, np.array([0.0, 0.0, 1.2]), k, k) for k, R in enumerate(turned))
    still = (square_outline(10, 9, 4.0), square_outline(11, 9, 4.0))
    write_observation(
        Observation(
            name="seq_0000",
            cameras=tuple(HsvCamera(name, intrinsics, np.eye(3), np.zeros(3)) for name in ("left", "right")),
            recordings=(moving, moving),
            clock=Clock(np.arange(PICTURES) / 4000.0, 5e-5),
            gravity_world=np.array([0.0, 9.80665, 0.0]),
            views=views,
            view_recording=still,
            mass_kg=3e-4,
            plate=Plate(np.array([0.0, 0.1, 0.6]), np.array([0.0, -1.0, 0.0]), np.zeros(3), 1e-3, 1e-5),
            plate_outlines=(square_outline(10, 16, 3.0), None),
            companion=Companion(views, still, 2e-4),
            further_recordings=(moving, (*moving[:2], Outline(np.zeros((0, 2))))),
        ),
        folder,
    )


def truth(folder: Path) -> None:
    """The truth of a particle with an impact, a mesh, a motion and masks."""
    with FrameStackWriter(folder / "given.tif", compression="zlib") as writer:
        for _ in range(2):
            writer.append(np.eye(HEIGHT, WIDTH, dtype=np.uint16))
    true = make_truth(frames=PICTURES)
    write_truth(make_truth(frames=PICTURES, impacts=(impact_at(true, 5e-4),), masks=TiffFrames(folder / "given.tif", 1)), folder)


def estimate(folder: Path) -> None:
    """An estimate with an impact."""
    true = make_truth(frames=PICTURES)
    write_estimate(with_impact(make_estimate(true, np.zeros(6)), impact_at(true, 5e-4)), folder / "e.json")


def documents(folder: Path) -> None:
    """A dataset, a baseline, a campaign, a diagnosis and a validation of contacts, as small as their schemas allow."""
    write_dataset(Dataset("d", ("a", "b"), 3, {"name": "d", "sequences": 2}, {"tumble": "0.1"}, "scalar_rgb"), folder)
    shutil.copyfile(ROOT / "baselines" / "quick.json", folder / "baseline.json")
    told = {"source": "x", "left_out": {"b": "why"}, "configuration": {"seed": 0, "deep": {"a": [1.5, None]}}, "versions": {"numpy": "2"}}
    value = {"effect": "gravity", "parameter": "dg_x", "unit": "m/s2", "sequence": None, "value": 0.1, "sigma": 0.01}
    values = [{**value, "interval": [0.0, 0.2], "plausible": True}]
    common = {**told, "sequences": [], "values": values, "settled": True, "rms_ete_px": 0.2}
    write_document(folder / "campaign.json", "campaign", {**common, "effects": [], "parameters": ["a"], "covariance": [[1.0]]})
    verdict = {"kind": "unknown", "sentence": "So it is.", "remarks": ["r"], "add": [], "next": "tumble"}
    empty = dict.fromkeys(("noise_floor", "maps", "diagnosis", "steps", "ladder"))
    given = {**common, **empty, "verb": "compare", "model": ["gravity"], "verdict": verdict, "unit": "px"}
    write_document(folder / "diagnosis.json", "diagnosis", given)


def meshes(folder: Path) -> None:
    """A closed body in the formats that particles are imported from."""
    for suffix in ("ply", "stl", "obj"):
        trimesh.creation.icosphere(subdivisions=1, radius=3e-3).export(folder / f"stone.{suffix}")


def texts(folder: Path) -> None:
    """A recipe, a configuration, a calibration, and trajectories in both formats with their side-car."""
    lens = {"width_px": WIDTH, "height_px": HEIGHT, "fx_px": 600.0, "fy_px": 600.0, "distortion": [0.01, 0.0, 0.0, 0.0, 0.0]}
    (folder / "camera.toml").write_text("".join(f"{key} = {value}\n" for key, value in lens.items()))
    (folder / "camera.json").write_text(json.dumps({"intrinsics": lens, "t_cam_world": [0.0, 0.0, 0.1]}))
    (folder / "gravity.toml").write_text("gravity_world = [0.0, 9.8, 0.1]\n")
    drag = EffectRecipe("uniform_acceleration", {"a_x": (0.5, 1.0), "a_y": 0.1})
    (folder / "recipe.toml").write_text(recipe_to_toml(Recipe(sequences=2, effects=(drag,), plate=PlateRecipe(), tier="silhouette")))
    (folder / "configuration.toml").write_text("hull_resolution = 32\nambiguity = 1.2\nkeep_out_of_plate = 1\nseed = 3\n")
    header = "t_s,x_m,y_m,z_m,qx,qy,qz,qw,wx_rads,wy_rads,wz_rads,sigma_x_m,sigma_y_m,sigma_z_m,sigma_theta_rad"
    rows = [f"{0.01 * k:g},{0.001 * k},{1e-2},-0.2,0,0,0,1,0.5,0,{3 + k},1e-4,1e-4,2e-4,0.01" for k in range(6)]
    (folder / "toss.csv").write_text("\n".join([header, *rows]) + "\n")
    lines = [f"{1.5e9 + 0.01 * k} {0.1 * k} 0.2 -0.1 0 0 0.6 0.8" for k in range(6)]
    (folder / "toss.tum").write_text("# timestamp tx ty tz qx qy qz qw\n" + "\n".join(lines) + "\n")
    side_car = 'gravity_world = [0.0, 0.0, -9.81]\ninertia_ratios = [1.0, 0.8, 0.5]\nsigma_x_m = 5e-4\nparticle = "stone A"\n'
    (folder / "trajectory.toml").write_text(side_car)


def pictures(folder: Path) -> None:
    """Stacks of the compressions that are read, in strips and tiles, of both byte orders."""
    rng = np.random.default_rng(1)
    stack = (rng.integers(0, 1 << BITS, (PICTURES, HEIGHT, WIDTH)) // 64 * 64).astype(np.uint16)
    grey = {"photometric": "minisblack", "metadata": None}
    with FrameStackWriter(folder / "none.tif") as writer:
        for picture in stack:
            writer.append(picture)
    tifffile.imwrite(folder / "deflate.tif", stack, compression="zlib", rowsperstrip=7, byteorder=">", **grey)
    tifffile.imwrite(folder / "tiles.tif", stack, compression="zlib", predictor=True, tile=(16, 16), bigtiff=True, **grey)
    (folder / "packbits.tif").write_bytes(tiff([pack_bits(p.astype("<u2").tobytes()) for p in stack], WIDTH, HEIGHT, 32773))


IMAGES = {"png": ".png", "deep": ".png", "bmp": ".bmp", "pgm": ".pgm", "jpg": ".jpg"}
"""Folders of pictures, and their kind."""


def videos(folder: Path) -> None:
    """Recordings of every kind that is imported."""
    rng = np.random.default_rng(2)
    values = (rng.integers(0, 1 << BITS, (PICTURES, HEIGHT, WIDTH)) // 64 * 64).astype(np.uint16)
    how = Recorded(4000.0, 5e-5, BITS, -1)
    for bits in (8, 10, 12, 16):
        shown = values >> 4 if bits == 8 else LINEAR_DN[values >> 2] if bits == 10 else values
        write_cine(folder / f"drop_{bits}.cine", list(shown), how, bits=bits)
        if bits != 10:
            write_mraw(folder / f"drop_{bits}.mraw", list(shown), how, bits=bits)
    shutil.copy(folder / "drop_12.mraw", folder / "drop_xml.mraw")
    (folder / "drop_xml.cihx").write_text("!\0\0" + CIHX + "\0\0", encoding="utf-8")
    grey = {"photometric": "minisblack", "metadata": None}
    tifffile.imwrite(folder / "lzw.tif", values, compression="lzw", predictor=True, rowsperstrip=7, **grey)
    tifffile.imwrite(folder / "zstd.tif", values, compression="zstd", **grey)
    tifffile.imwrite(folder / "jpeg.tif", (values >> 4).astype(np.uint8), compression="jpeg", rowsperstrip=8, **grey)
    for bits in (8, 16):
        write_film(folder / f"ffv1_{bits}.avi", list(values >> 4 if bits == 8 else values), 30.0, bits=bits)
    write_film(folder / "mjpg.avi", list(values >> 4), 30.0, bits=8, codec="MJPG")
    write_film(folder / "film.mp4", list(values >> 4), 30.0, bits=8, codec="mp4v")
    for name, suffix in IMAGES.items():
        (folder / name).mkdir()
        for k, picture in enumerate(values):
            Image.fromarray(picture if name == "deep" else (picture >> 4).astype(np.uint8)).save(folder / name / f"{k}{suffix}")


CIHX = f"""<cih><imageFileInfo><fileFormat>Mraw</fileFormat></imageFileInfo>
<imageDataInfo><resolution><width>{WIDTH}</width><height>{HEIGHT}</height></resolution>
<colorInfo><type>Raw</type><bit>12</bit></colorInfo><effectiveBit><depth>{BITS}</depth><side>Lower</side></effectiveBit></imageDataInfo>
<frameInfo><totalFrame>{PICTURES}</totalFrame><startFrame>-1</startFrame><skipFrame>1</skipFrame></frameInfo>
<recordInfo><recordRate>4000</recordRate><shutterSpeed>20000</shutterSpeed><shutterSpeedNsec>50000</shutterSpeedNsec></recordInfo>
<deviceInfo><deviceName>a camera</deviceName></deviceInfo></cih>"""


def tiff(strips: list[bytes], width: int, height: int, compression: int, *, bits: int = 16, loop: int | None = None) -> bytes:
    """A classic little-endian TIFF of one strip a page; ``loop``: the page that follows the last one instead of none."""
    found, places = bytearray(b"II*\0" + struct.pack("<I", 0)), [4]
    starts = []
    for strip in strips:
        at = len(found)
        found += strip + b"\0" * (len(strip) % 2)
        starts.append(len(found))
        found[places[-1] : places[-1] + 4] = struct.pack("<I", len(found))
        entries = [(256, width), (257, height), (258, bits), (259, compression), (262, 1), (273, at), (277, 1), (278, height)]
        entries.append((279, len(strip)))
        found += struct.pack("<H", len(entries)) + b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in entries)
        places.append(len(found))
        found += struct.pack("<I", 0)
    if loop is not None:
        found[places[-1] : places[-1] + 4] = struct.pack("<I", starts[loop])
    return bytes(found)


def pack_bits(data: bytes) -> bytes:
    """``data`` in PackBits, runs and literals of at most 128 bytes."""
    found, at = bytearray(), 0
    while at < len(data):
        run = next((k for k in range(1, min(128, len(data) - at)) if data[at + k] != data[at]), min(128, len(data) - at))
        if run > 1:
            found += bytes([257 - run, data[at]])
        else:
            found += bytes([0, data[at]])
        at += run
    return bytes(found)
