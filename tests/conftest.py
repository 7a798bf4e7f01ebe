"""For all tests: no fixed times. A busy computer is slow, and that is no fault of the code."""

from hypothesis import settings

settings.register_profile("patient", deadline=None, print_blob=True)
settings.load_profile("patient")
