"""The attack finds readers that break its rules: a wrong exception, a message without the file, writing, endless work, too much memory."""

import json
import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PLANTED = """
import sys, tempfile
from pathlib import Path
import numpy as np
from datasets.errors import InputError
from tests.hostile import attack
from tests.hostile.mutations import BYTES
from tests.hostile.readers import Reader

def write(folder): (folder / "f").write_bytes(bytes(range(100)))
def wrong(folder): raise KeyError("x")
def nameless(folder): raise InputError("something is wrong")
def writing(folder): (folder.parent / "elsewhere").write_text("x")
def warning(folder): np.float64(1e308) * 10
def endless(folder):
    while True: pass
def greedy(folder): np.ones(2**28)
def good(folder): raise InputError(f"{folder}: refused")

def reader(name):
    def read(folder):  # the valid file is read
        if (folder / "f").read_bytes() != bytes(range(100)):
            globals()[name](folder)
    return Reader(name, write, "f", BYTES, read)

attack.LONGEST_S = 0.3
attack.READERS = tuple(map(reader, sys.argv[1:]))
attack.work(sys.argv[1:], 0, 2, show=False)
"""
SAID = {
    "wrong": "KeyError: 'x'",
    "nameless": "the message names no file: something is wrong",
    "writing": "the reader did [",
    "warning": "RuntimeWarning: overflow",
    "greedy": "MemoryError",
    "good": "",
}


def test_what_is_planted_is_found() -> None:
    command = [sys.executable, "-c", PLANTED, *SAID, "endless"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == -signal.SIGPROF
    cases = [json.loads(line) for line in done.stdout.splitlines()]
    assert (cases[-1]["reader"], cases[-1]["number"]) == ("endless", 0)
    for name, said in SAID.items():
        found = [case["said"] for case in cases if case["reader"] == name and "said" in case]
        assert len(found) == 2
        assert all(each.startswith(said) if said else each == "" for each in found), found
