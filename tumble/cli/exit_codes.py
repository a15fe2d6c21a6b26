"""What the exit code of every verb means; the table in docs/command_line.md is this one."""

from collections.abc import Mapping
from types import MappingProxyType

ALL_MEASURED, INCOMPLETE, BAD_INPUT, OWN_FAULT, INTERRUPTED = 0, 1, 2, 3, 130

MEANING: Mapping[int, str] = MappingProxyType(
    {
        ALL_MEASURED: "everything that was asked for was measured or written; where a verb answers yes or no: yes",
        INCOMPLETE: "something was not measured (it is named, with its reason), or the answer is no",
        BAD_INPUT: "the input or the command line is at fault, or the machine (a full disk); nothing could be measured",
        OWN_FAULT: "a fault of Tumble itself; `-v` shows where",
        INTERRUPTED: "stopped by Ctrl-C",
    }
)
IN_SHORT = "exit code: 0 all measured, 1 something was not (it is named) or the answer is no, 2 bad input, 3 a fault of Tumble, 130 stopped"
