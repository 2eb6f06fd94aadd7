"""What several tests share."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.fixture(scope="session")
def chromium() -> str:
    """The path of a Chromium; without one the test is skipped, or fails where one was promised."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if path := shutil.which(name):
            return path
    if os.environ.get("PDHOCBF_REQUIRE_BROWSER"):
        pytest.fail("no Chromium on this machine, which was promised one")
    pytest.skip("no Chromium on this machine")


@pytest.fixture
def elsewhere(tmp_path, monkeypatch) -> Iterator:
    """An empty folder that the test runs in."""
    monkeypatch.chdir(tmp_path)
    yield tmp_path
