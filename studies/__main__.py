"""``python -m studies``: workers, which do all work, begin with one thread each."""

import os

from studies.frame.command import main
from studies.pages import uncertainty
from studies.registry import STUDIES
from tumble.one_thread import keep_to_one_thread

if __name__ == "__main__":
    keep_to_one_thread(os.environ)
    raise SystemExit(main(STUDIES, uncertainty.page))
