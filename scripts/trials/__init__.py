"""Studies from before the one frame (:mod:`studies`), one file each."""
