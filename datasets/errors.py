"""Errors a person can act on; the command line turns them into an exit code and one plain message.

An :class:`InputError` means that something given from outside (a file, a setting, an argument) is wrong. Its
message names what was read, what was expected and what came. Anything else that Tumble raises on purpose is a
:class:`TumbleError`, for instance a disk that is full. Programming mistakes keep Python's own exception types.
"""


class TumbleError(Exception):
    """Base of every error that Tumble raises on purpose; its text is meant for a person."""


class InputError(TumbleError):
    """A file, setting or argument from outside is wrong; the command line ends with exit code 2."""
