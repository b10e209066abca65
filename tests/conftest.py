"""What every test shares: Hypothesis profiles and the repository's root.

`ci`, the default, tries the same inputs every time, so that a red run can be had again; `long` looks for
new ones and for longer: `HYPOTHESIS_PROFILE=long pytest`.
"""

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(
    "ci", derandomize=True, deadline=None, print_blob=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("long", derandomize=False, deadline=None, max_examples=5_000, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))


@pytest.fixture(scope="session")
def repo() -> Path:
    """The checkout's root."""
    return Path(__file__).parents[1]
