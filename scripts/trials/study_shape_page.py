"""The page of :mod:`scripts.trials.study_shape`, from its result file: ``python -m scripts.trials.study_shape_page``."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from studies.reporting.words import write_page

ROOT = Path(__file__).resolve().parents[2]
RESULT, PAGE = ROOT / "docs" / "results" / "study_shape.json", ROOT / "docs" / "studies" / "study_shape.md"
CONVEX = 0.95
"""Share of its convex hull that a body fills to count as convex."""
Rows = Sequence[Mapping[str, Any]]


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a Markdown table."""
    return [f"| {' | '.join(row)} |" for row in (headings, ["---"] * len(headings), *rows)]


def merging(rows: Rows) -> list[str]:
    """Ten drops of outlines."""
    cells = [
        [
            r["particle"],
            f"{r['placed']} of 10",
            f"{r['relative_rotation_deg']['median']:.3f}°, {r['relative_rotation_deg']['largest']:.3f}°",
            f"{r['place_um_rms']:.2f} µm",
            f"{r['inside_95']:.0%}",
            f"{r['rms_ete_px']:.3f} px",
            f"{1e2 * r['volume_error']:+.2f}% (± {1e2 * r['volume_sigma']:.2f}%)",
            f"{r['seconds_merging']:.0f} s, {r['seconds_in_all']:.0f} s",
        ]
        for r in rows
    ]
    left = sum(len(r["left_out"]) for r in rows)
    return [
        "## Ten drops of six outlines, orientation unknown",
        "",
        *table(
            ["particle", "placed", "turn: median, largest", "place, RMS", "inside 95%", "RMS ETE", "volume", "merging, all"],
            cells,
        ),
        "",
        f"Views left out wrongly: {left} of {60 * len(rows)}. *Turn*: relative rotation of two drops. *Inside 95%*: coordinates of the "
        "placements within 1.96 of their stated standard deviations. Time: of one process. *All* has the checks, hulls and everything that "
        "the particle file keeps.",
    ]


def pictures(rows: Rows) -> list[str]:
    """Ten drops of pictures."""
    cells = [
        [
            r["particle"],
            f"{r['placed']} of 10",
            f"{r['relative_rotation_deg']['median']:.3f}°, {r['relative_rotation_deg']['largest']:.3f}°",
            f"{r['place_um_rms']:.2f} µm",
            f"{r['rms_ete_px']:.3f} px",
            str(len(r["left_out"])),
            f"{r['seconds']:.0f} s",
        ]
        for r in rows
    ]
    return [
        "## Ten rendered drops",
        "",
        "Pictures and backgrounds in files, as a user has them.",
        "",
        *table(["particle", "placed", "turn: median, largest", "place, RMS", "RMS ETE", "left out", "time"], cells),
    ]


def foreign(found: Mapping[str, Any]) -> list[str]:
    """What does not belong."""
    count = found["trials_of_each"]
    return [
        "## A drop, or a view, of another particle",
        "",
        "Five drops of cut stones, one of them, or one view, of another cut stone seen by the same cameras. Named: the drop in "
        f"{found['named']['set']} of {count}, the view in {found['named']['view']} of {count}. Left out besides: "
        f"{found['left_out_wrongly']} of {found['of_views']} views.",
    ]


def _verdict(row: Mapping[str, Any]) -> str:
    if "refused" in row:
        return "ambiguous" if "equally well" in row["refused"] else "refused"
    return "right" if row["right"] else "**wrong**"


def _angles(row: Mapping[str, Any]) -> str:
    return f"{row['relative_rotation_deg']['median']:.2f}°, {row['relative_rotation_deg']['largest']:.2f}°"


def real(found: Mapping[str, Any]) -> list[str]:
    """Real outlines."""
    cells = [
        [
            name,
            _verdict(r),
            "–" if "refused" in r else _angles(r),
            "–" if "refused" in r else f"{max(r['rms_ete_px']):.2f} px",
            f"{r['seconds']:.1f} s",
        ]
        for name, r in found.items()
    ]
    return [
        "## Real outlines, cut into sets whose relative pose is withheld",
        "",
        "The turntable's 36 views as six sets of six, two ways; the stone's six views as two sets of three, all ten ways, and each as a "
        "drop of its own. Right: within 1°, of a single view within 5°. The given calibrations disagree with themselves by 0.43 and "
        "0.70 px RMS ([real outlines](real_outlines.md)).",
        "",
        *table(["set", "", "rotation from what was given: median, largest", "worst set's RMS ETE", "time"], cells),
    ]


def volumes(rows: Rows) -> list[str]:
    """Volume and inertia against the number of views."""
    cells = []
    for kind, some in (
        ("convex", [r for r in rows if r["convexity"] >= CONVEX]),
        ("with hollows", [r for r in rows if r["convexity"] < CONVEX]),
    ):
        for count in sorted({r["views"] for r in some}):
            here = [r for r in some if r["views"] == count]
            cells.append([kind, str(count), *_volume_cells(here)])
    inside = [r for r in rows if r["convexity"] >= CONVEX]
    return [
        "## Volume and inertia against the number of views",
        "",
        "Medians over the particles, poses as given. *Inside*: the error is within two standard deviations.",
        "",
        *table(
            [
                "bodies",
                "views",
                "hull's volume",
                "volume stated",
                "its standard deviation",
                "inside",
                "moments' ratios",
                "inside",
                "centre",
            ],
            cells,
        ),
        "",
        f"Of convex bodies the volume is inside in {_share(inside, 'volume_error', 'volume_sigma'):.0%}, the moments in "
        f"{_share(inside, 'inertia_ratio_error', 'inertia_ratio_sigma'):.0%} of {len(inside)}.",
    ]


def _volume_cells(rows: Rows) -> list[str]:
    def median(key: str) -> float:
        return float(np.median([abs(r[key]) for r in rows]))

    return [
        f"{1e2 * median('hull_volume_error'):.2f}%",
        f"{1e2 * median('volume_error'):.2f}%",
        f"{1e2 * median('volume_sigma'):.2f}%",
        f"{_share(rows, 'volume_error', 'volume_sigma'):.0%}",
        f"{1e2 * median('inertia_ratio_error'):.2f}%",
        f"{_share(rows, 'inertia_ratio_error', 'inertia_ratio_sigma'):.0%}",
        f"{median('com_error_um'):.1f} µm",
    ]


def _share(rows: Rows, error: str, sigma: str) -> float:
    return float(np.mean([abs(r[error]) <= 2.0 * r[sigma] for r in rows]))


def velocities(found: Mapping[str, Any]) -> list[str]:
    """Merged against given views."""
    ratio, count = found["rms_merged_over_given"], len([r for r in found["sequences"] if r["given"] and r["merged"]])
    return [
        "## Velocities with merged views",
        "",
        f"RMS error with merged views over that with the given ones, {count} of {len(found['sequences'])} sequences measured both ways: "
        f"v in the picture's plane {ratio['middle_in_plane_ms']:.2f}, out of it {ratio['middle_out_of_plane_ms']:.2f}, "
        f"ω {ratio['middle_angular_rads']:.2f}.",
    ]


def known(rows: Rows) -> list[str]:
    """What a particle file saves."""
    cells = [
        [
            r["particle"],
            r["views"],
            f"{r['seconds']['without']:.1f} s",
            f"{r['seconds']['with']:.1f} s",
            f"{r['share']:.0%}",
            "yes" if r["identical"] else "**no**",
        ]
        for r in rows
    ]
    return [
        "## What the particle file saves",
        "",
        "A second sequence of a known particle, 60 views, outlines of 100 frames; time of one process without starting Python.",
        "",
        *table(["particle", "views as", "made on the way", "kept", "share", "identical"], cells),
    ]


PARTS: dict[str, Callable[[Any], list[str]]] = {
    **{"merging": merging, "pictures": pictures, "foreign": foreign, "real": real},
    **{"volumes": volumes, "velocities": velocities, "known": known},
}


def page(document: Mapping[str, Any]) -> list[str]:
    """The page's lines."""
    body = [line for name, make in PARTS.items() if name in document for line in (*make(document[name]), "")]
    return [
        "# Drops merged into one set of views",
        "",
        "How well `tumble shape` places drops whose orientation nobody knows, what it names as not belonging, what a particle file saves.",
        "Figures from [study_shape.json](../results/study_shape.json); times are of a machine that had other work to do.",
        "",
        *body,
        "```sh",
        "python -m scripts.trials.study_shape --data FOLDER --result docs/results/study_shape.json",
        "python -m scripts.trials.study_shape_page",
        "```",
    ]


def main() -> int:
    """Write the page."""
    write_page(page(json.loads(RESULT.read_text(encoding="utf-8"))), PAGE)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
