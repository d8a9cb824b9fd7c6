"""Fixtures that every test may ask for."""

from pathlib import Path

import pytest

from configs.source_code import PROJECT_ROOT

SHARED_DATA = PROJECT_ROOT.parent / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real motion beside the checkout, or skip the test where it is absent."""
    if not SHARED_DATA.is_dir():
        pytest.skip("needs ../shared/data, real motion that may not be part of the repository")
    return SHARED_DATA
