"""Programs for developers of this project; they run in a checkout and are not installed.

They calculate with one thread, as the command `nxtdrive` does.
"""

import os

from nxtdrive.cli.main import BLAS_THREADS

os.environ.setdefault(BLAS_THREADS, "1")
