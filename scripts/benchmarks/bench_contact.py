"""Speeds of the contact models: ``python -m scripts.benchmarks.bench_contact --json`` or ``tumble bench --only contact``.

Processor time of one core, compilation not counted.
"""

import argparse
import json
import os
from typing import Any

from tumble.one_thread import keep_to_one_thread

keep_to_one_thread(os.environ)

import numpy as np  # noqa: E402 - after the threads are limited

from scripts.benchmarks.contact_speeds import clump_seconds, contacts_per_second, impulses_per_second  # noqa: E402


def figures() -> list[dict[str, Any]]:
    """Every figure with its unit and, where there is one, its limit."""
    strikes = impulses_per_second(np.random.default_rng(1))
    contacts = contacts_per_second(np.random.default_rng(2))
    clump = clump_seconds(np.random.default_rng(3))
    return [
        {
            "name": "impulse model, whole impacts one by one",
            "value": strikes,
            "unit": "1/s of one core",
            "limit": 1000.0,
            "direction": "higher",
        },
        {"name": "impulse model, contacts in one call", "value": contacts, "unit": "1/s of one core"},
        {"name": "Hertz–Mindlin, clump of 50 spheres", "value": clump, "unit": "s of one core", "limit": 1.0, "direction": "lower"},
    ]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.parse_args()
    print(json.dumps(figures()))
