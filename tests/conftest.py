"""How Hypothesis tries: without deadlines, since on a busy machine any time may pass."""

from hypothesis import settings

settings.register_profile("patient", deadline=None)
settings.load_profile("patient")
