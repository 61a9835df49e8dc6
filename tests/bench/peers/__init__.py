"""Other ways of finding a dock, and other thresholds, on the same poses, water, noise and exposure: ``make peers``."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: times are those of one thread
