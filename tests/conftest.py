"""Settings of all tests."""

import os

from hypothesis import HealthCheck, settings

# On CI the examples are the same each time, so that a red run means a change for the worse; elsewhere they are new.
settings.register_profile("new", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("ci" if os.environ.get("CI") else "new")
