"""Names of sequences, which become names of files and keys: letters, digits, ``_``, ``.`` and ``-``, without a point in front."""

import re
import unicodedata


def file_name(text: str) -> str:
    """``text`` as such a name: accents are taken off, whatever else is not allowed becomes ``_``."""
    plain = "".join(letter for letter in unicodedata.normalize("NFKD", text) if not unicodedata.combining(letter))
    name = re.sub(r"[^A-Za-z0-9_.-]", "_", plain)
    return re.sub(r"^\.", "_", name) or "_"
