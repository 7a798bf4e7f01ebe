"""For all tests: no fixed times. A busy computer is slow, and that is no fault of the code."""

import os

from hypothesis import settings

# daemons of tests that run side by side: each page takes a free port
os.environ.setdefault("TRIBOWATCH_PAGE__LISTEN", "127.0.0.1:0")

settings.register_profile("patient", deadline=None, print_blob=True)
settings.load_profile("patient")
