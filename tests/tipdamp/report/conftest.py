"""Two reports that are written once."""

import pytest

from tests.tipdamp.report.files import HOSTILE, HOSTILE_NAMES, written


@pytest.fixture(scope="session")
def plain_report(tmp_path_factory):
    return written(tmp_path_factory.mktemp("plain"))


@pytest.fixture(scope="session")
def hostile_report(tmp_path_factory):
    """Failed points, and a title and names of sides and patches that mean harm, together."""
    return written(
        tmp_path_factory.mktemp("hostile"), title=HOSTILE, failed=(19, 20), names=HOSTILE_NAMES
    )
