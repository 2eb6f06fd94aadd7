"""What several tests share."""

from __future__ import annotations

import gc
import os
import shutil
from collections.abc import Iterator

import hypothesis
import pytest

hypothesis.settings.register_profile("any machine", deadline=None)  # a busy machine is no fault
hypothesis.settings.load_profile("any machine")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ["PDHOCBF_CACHE"] = "off"  # what one test changes in a program must not be read by another

SLOW = {
    "test_analysis_figures", "test_bench", "test_campaign_faults", "test_certify_terminal", "test_certify_walk",
    "test_cli", "test_closed_loop", "test_degraded", "test_design_bound", "test_examples", "test_faults_robot",
    "test_filter_units", "test_jit", "test_ladder", "test_mpc_controller", "test_mpc_terms", "test_notebooks",
    "test_output", "test_products", "test_push_robot", "test_push_worth", "test_replay_page", "test_reproduce",
    "test_simulate", "test_stand_robot", "test_stepping", "test_studies_shared", "test_van_der_pol",
    "test_import_command", "test_import_copy", "test_import_formats", "test_import_reading",
    "test_walk_barriers", "test_walk_controller", "test_commands", "test_commands_robot", "test_command_port",
    "test_commanded_bounds", "test_directions", "test_uneven_ground", "test_any_size", "test_fused",
    "test_sensing_study",
    "test_sensors_robot", "test_named_robots", "test_certify_disturbance", "test_robust_study", "test_tune",
    "test_friction", "test_joint_limits", "test_whole_body_robot", "test_footing",
    "test_limits_study", "test_first_walk",
}  # fmt: skip
"""Files of tests that together take most of the time; `make quick` leaves them out."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks every test of the slow files, which come first where several processes share the files.

    So no process is left with a long file at the end.
    """
    for item in items:
        if item.path.stem in SLOW:
            item.add_marker(pytest.mark.slow)
    if "PYTEST_XDIST_WORKER" in os.environ:
        items.sort(key=lambda item: item.path.stem not in SLOW)


@pytest.fixture(scope="module", autouse=True)
def _freed() -> Iterator[None]:
    """Frees the diagrams of a file's tests, and what a command that they ran has put aside as imported."""
    yield
    gc.unfreeze()
    gc.collect()


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
