"""Attacks readers with spoiled files, in a process of its own, and says what happened.

Each spoiled file has to be read, or refused by an ``InputError`` that names its folder: no other exception or warning, at most
:data:`LONGEST_S` of CPU time, at most :data:`MOST_MEMORY_BYTES` more memory than before, and nothing written, removed or started.

    python -m tests.hostile.attack --count 2000                    # every reader; about a quarter of an hour
    python -m tests.hostile.attack --count 2000 --reader toss.csv
    python -m tests.hostile.attack --reader toss.csv --only 17     # one file again, with its traceback
"""

import argparse
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from datasets.errors import InputError
from tests.hostile.readers import READERS, Reader

ROOT = Path(__file__).resolve().parents[2]
SEED = 32
LONGEST_S = 5.0
LONGEST_WAIT_S = 60
"""Of a clock on the wall, for a reader that waits instead of working; machines of tests are busy."""
MOST_MEMORY_BYTES = 2**30
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
ACTS = ("os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.truncate", "os.chmod", "os.system", "os.exec")
STARTS = ("os.posix_spawn", "os.fork", "subprocess.Popen", "socket.connect", "shutil.", "urllib.")


class Watch:
    """What a reader does to the system while it is armed; an audit hook cannot be taken off again."""

    def __init__(self) -> None:
        self.armed = False
        self.found: list[str] = []
        sys.addaudithook(self._heard)

    def _heard(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self.armed:
            return
        writes = event == "open" and isinstance(arguments[2], int) and bool(arguments[2] & WRITING)
        if writes or event.startswith((*ACTS, *STARTS)):
            self.found.append(f"{event} {arguments[0]!r}"[:200])


def spoiled(reader: Reader, data: bytes, number: int) -> tuple[str, bytes]:
    """Spoiled file ``number`` of a reader and how it came about; the same in every run."""
    rng = np.random.default_rng([SEED, zlib.crc32(reader.name.encode()), number])
    mutation = reader.mutations[int(rng.integers(len(reader.mutations)))]
    return mutation.__name__, mutation(data, rng)


def fault(reader: Reader, folder: Path, watch: Watch, *, show: bool) -> str | None:
    """Read the folder; ``None`` where it was read, "" where it was refused as it should be, otherwise what is wrong."""
    watch.found.clear()
    watch.armed = True
    signal.setitimer(signal.ITIMER_PROF, LONGEST_S)  # its signal ends the process
    signal.alarm(LONGEST_WAIT_S)
    try:
        reader.read(folder)
        said = None
    except InputError as error:
        said = "" if str(folder) in str(error) else f"the message names no file: {error}"
    except BaseException as error:
        if show:
            traceback.print_exc()
        said = f"{type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.alarm(0)
        watch.armed = False
    return f"the reader did {watch.found}" if watch.found else said


def attacked(reader: Reader, numbers: range, watch: Watch, folder: Path, *, show: bool = False) -> None:
    """Read spoiled files ``numbers`` of one reader; a line of JSON before and after each."""
    folder.mkdir()
    reader.write(folder)
    path = folder / reader.file
    whole = path.read_bytes()
    reader.read(folder)
    before = resource.getrusage(resource.RUSAGE_SELF)
    for number in numbers:
        how, data = spoiled(reader, whole, number)
        path.write_bytes(data)
        case = {"reader": reader.name, "number": number, "how": how}
        print(json.dumps(case), flush=True)
        began = time.process_time()
        said = fault(reader, folder, watch, show=show)
        memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before.ru_maxrss) / 1024
        print(json.dumps({**case, "said": said, "s": time.process_time() - began, "mb": memory}), flush=True)


def work(names: list[str], first: int, count: int, *, show: bool) -> None:
    """Attack readers in this process, the first of them from file ``first`` on."""
    warnings.simplefilter("error")
    sys.dont_write_bytecode = True
    watch = Watch()
    taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + MOST_MEMORY_BYTES,) * 2)
    with tempfile.TemporaryDirectory() as root:
        for name in names:
            reader = next(reader for reader in READERS if reader.name == name)
            attacked(reader, range(first if name == names[0] else 0, count), watch, Path(root) / name, show=show)


@dataclass
class Tally:
    """What became of the spoiled files of one reader; ``failures`` were neither read nor refused as they should be."""

    read: int = 0
    refused: int = 0
    failures: list[str] = field(default_factory=list)
    slowest_s: float = 0.0
    memory_mb: float = 0.0

    def add(self, case: dict[str, Any]) -> None:
        """Count one file."""
        self.read += case["said"] is None
        self.refused += case["said"] == ""
        self.slowest_s, self.memory_mb = max(self.slowest_s, case["s"]), max(self.memory_mb, case["mb"])
        if case["said"]:
            self.failures.append(f"{case['number']} ({case['how']}): {case['said']}"[:400])


def attack(names: list[str], count: int) -> dict[str, Tally]:
    """Attack readers in a process of its own; where a file ends it, a new process goes on after that file."""
    found = {name: Tally() for name in names}
    waiting, first = list(names), 0
    while waiting:
        command = [sys.executable, "-m", "tests.hostile.attack", "--count", str(count), "--work", str(first), "--reader", *waiting]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        lines = [json.loads(line) for line in done.stdout.splitlines()]
        for case in lines:
            if "said" in case:
                found[case["reader"]].add(case)
        if done.returncode == 0:
            break
        if not lines:
            raise RuntimeError(f"no file was read: {done.stderr}")
        last = lines[-1]
        ended = f"ended the process with {done.returncode}: {done.stderr[-300:]}"
        found[last["reader"]].failures.append(f"{last['number']} ({last['how']}): {ended}")
        waiting, first = waiting[waiting.index(last["reader"]) :], last["number"] + 1
    return found


def main() -> int:
    """Attack and print a table; exit code 1 when a file was neither read nor refused."""
    names = [reader.name for reader in READERS]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100, help="spoiled files for each reader")
    parser.add_argument("--reader", nargs="*", default=names, choices=names, metavar="NAME", help="readers: " + ", ".join(names))
    parser.add_argument("--only", type=int, metavar="NUMBER", help="one spoiled file again, with its traceback")
    parser.add_argument("--work", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.only is not None:
        work(given.reader, given.only, given.only + 1, show=True)
        return 0
    if given.work is not None:
        work(given.reader, given.work, given.count, show=False)
        return 0
    failed = 0
    print(f"{'reader':<20} {'read':>6} {'refused':>8} {'failed':>7} {'slowest (s)':>12} {'memory (MB)':>12}")
    for name in given.reader:
        row = attack([name], given.count)[name]
        failed += len(row.failures)
        figures = f"{row.read:>6} {row.refused:>8} {len(row.failures):>7} {row.slowest_s:>12.2f} {row.memory_mb:>12.1f}"
        print("\n".join([f"{name:<20} {figures}", *(f"    {failure}" for failure in row.failures)]), flush=True)
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
