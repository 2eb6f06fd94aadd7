"""The table of a campaign, its rates and its page."""

from __future__ import annotations

import asyncio
import re
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from campaigns import campaign_file

from pdhocbf_drake.errors import RunFolderError
from pdhocbf_drake.studies.campaign import dispatch as dispatching
from pdhocbf_drake.studies.campaign.dispatch import Outcome
from pdhocbf_drake.studies.campaign.plan import PlannedRun, load_campaign, plan_runs
from pdhocbf_drake.studies.campaign.report import campaign_report
from pdhocbf_drake.studies.campaign.store import CampaignStore, locked
from pdhocbf_drake.studies.campaign.survival import campaign_summary, paired, survival_rate


@pytest.fixture
def planned(tmp_path) -> list[PlannedRun]:
    config, _ = load_campaign(str(campaign_file(tmp_path, runs=40)))
    return plan_runs(config, tmp_path)


def ended(run: PlannedRun, status: str = "survived", error: str | None = None) -> Outcome:
    metrics = {"ending": "finished", "wall_seconds": 1.0, "slip_max": None, "mpc": {"fallbacks": 2, "slack_max": 0.5}}
    return Outcome(run, None if error else status, None if error else metrics, error, 1, "tcp://127.0.0.1:1")


def filled(folder, planned: list[PlannedRun]) -> CampaignStore:
    """Small pushes are survived, except that the worker of the last run dies."""
    store = CampaignStore(folder, planned)
    for run in planned[:-1]:
        store.add(ended(run, "survived" if abs(run.factors["pushes.0.force.0"]) < 10 else "fell"))
    store.add(ended(planned[-1], error="its worker died, 2 times"))
    return store


def test_rows_are_found_again_from_parts_and_from_the_table(tmp_path, planned) -> None:
    folder = tmp_path / "out"
    store = filled(folder, planned)
    assert CampaignStore(folder, planned).rows == store.rows  # as after a killed command
    store.consolidate()
    again = CampaignStore(folder, planned)
    assert again.rows.keys() == store.rows.keys()
    table = pq.read_table(folder / "runs.parquet")
    assert table["run"].to_pylist() == list(range(len(planned)))
    assert table["pushes.0.force.0"].to_pylist() == [run.factors["pushes.0.force.0"] for run in planned]
    assert str(table.schema.field("metrics.slip_max").type) == "double"  # a column of nulls is still one of numbers
    again.consolidate()
    assert sorted(path.name for path in folder.iterdir()) == ["runs.parquet"]


def test_a_torn_part_costs_its_run_only(tmp_path, planned) -> None:
    folder = tmp_path / "out"
    filled(folder, planned)
    part = folder / "parts" / "run-000003.parquet"
    part.write_bytes(part.read_bytes()[:100])
    assert set(range(len(planned))) - CampaignStore(folder, planned).rows.keys() == {3}


def test_a_folder_of_another_campaign_is_refused_and_kept(tmp_path, planned) -> None:
    folder = tmp_path / "out"
    filled(folder, planned).consolidate()
    before = (folder / "runs.parquet").read_bytes()
    config, _ = load_campaign(str(campaign_file(tmp_path, runs=40, seed=4)))
    with pytest.raises(RunFolderError, match="holds results of another campaign"):
        CampaignStore(folder, plan_runs(config, tmp_path))
    assert (folder / "runs.parquet").read_bytes() == before


def test_a_folder_is_written_by_one_command_at_a_time(tmp_path) -> None:
    with locked(tmp_path), pytest.raises(RunFolderError, match="another campaign is writing"), locked(tmp_path):
        pass


def test_wilson_intervals_hold_the_rate_and_shrink_with_n() -> None:
    rows = [{"status": "survived"}] * 8 + [{"status": "fell"}] * 2 + [{"status": "failed"}] * 5
    rate, low, high, n = survival_rate(rows)
    assert (rate, n) == (0.8, 10)
    # Wilson's formula, by hand: (p + z²/2n ± z √(p(1−p)/n + z²/4n²)) / (1 + z²/n)
    z = 1.959963984540054
    centre = (0.8 + z**2 / 20) / (1 + z**2 / 10)
    half = z * np.sqrt(0.8 * 0.2 / 10 + z**2 / 400) / (1 + z**2 / 10)
    assert (low, high) == pytest.approx((centre - half, centre + half))
    _, low_10, high_10, _ = survival_rate(rows * 10)
    assert low < low_10 < rate < high_10 < high
    assert survival_rate([]) == (None, None, None, 0)
    assert survival_rate([{"status": "survived"}] * 5).low < 1.0  # five survivors are no proof


def test_the_summary_counts_and_pairs(tmp_path, planned) -> None:
    rows = list(filled(tmp_path / "out", planned).rows.values())
    summary = campaign_summary(len(planned), ["none", "limited"], rows)
    assert set(summary) == {"runs", "succeeded", "failed", "survival"}
    assert (summary["runs"], summary["succeeded"], summary["failed"]) == (40, 39, 1)
    assert set(summary["survival"]["none"]) == {"rate", "low", "high", "n"}
    assert [summary["survival"][name]["n"] for name in ("none", "limited")] == [20, 19]
    assert paired(rows, "none", "limited") == (19, 0, 0)
    rows[0] = {**rows[0], "status": "fell" if rows[0]["status"] == "survived" else "survived"}
    assert sum(paired(rows, "none", "limited")[1:]) == 1


def test_the_page_has_no_external_resources_and_shows_maps_and_failures(tmp_path, planned) -> None:
    config, _ = load_campaign(str(tmp_path / "tiny.yaml"))
    rows = list(filled(tmp_path / "out", planned).rows.values())
    page = campaign_report("tiny", config, len(planned), rows)
    assert page.count("data:image/png;base64,") == 3  # intervals, curves, one map of the two factors
    assert "its worker died, 2 times" in page
    assert not re.search(r"(src|href)=\"(?!data:)", page)


def test_the_page_of_a_campaign_that_was_stopped_at_once_can_be_read(tmp_path, planned) -> None:
    config, _ = load_campaign(str(tmp_path / "tiny.yaml"))
    assert "40 are still missing" in campaign_report("tiny", config, len(planned), [])


class SlowFuture:
    """A finished run whose row arrives late, or never."""

    status = "finished"

    def __init__(self, late: int) -> None:
        self._late, self.asked = late, 0

    def result(self, timeout: float) -> dict[str, Any]:
        self.asked += 1
        if self.asked <= self._late:
            raise asyncio.TimeoutError
        return {"status": "finished", "metrics": {}, "worker": "w"}

    def release(self) -> None:
        pass


class BusyClient:
    """What of Dask's client a dispatcher needs for one run, which a worker has or has lost."""

    status = "running"

    def __init__(self, future: SlowFuture, holders: tuple[str, ...]) -> None:
        self._future, self._holders, self.submitted = future, holders, 0

    def submit(self, *_: Any, **__: Any) -> SlowFuture:
        self.submitted += 1
        return self._future

    def who_has(self, futures: list[SlowFuture]) -> dict[str, tuple[str, ...]]:
        return {"key": self._holders}

    def nthreads(self) -> dict[str, int]:
        return {"w": 1}

    def subscribe_topic(self, *_: Any) -> None:
        pass

    def unsubscribe_topic(self, *_: Any) -> None:
        pass

    def cancel(self, *_: Any, **__: Any) -> None:
        pass


@pytest.mark.parametrize(
    ("late", "holders", "asked", "submitted"), [(0, ("w",), 1, 1), (3, ("w",), 4, 1), (1, (), 2, 2)]
)
def test_a_row_that_comes_late_is_waited_for_as_long_as_a_worker_has_it(
    monkeypatch: pytest.MonkeyPatch, planned: list[PlannedRun], late: int, holders: tuple[str, ...], asked: int,
    submitted: int,
) -> None:  # fmt: skip
    monkeypatch.setattr(dispatching, "wait", lambda *_, **__: None)
    future = SlowFuture(late)
    client: Any = BusyClient(future, holders)
    (outcome,) = [found for found in dispatching.dispatch(client, planned[:1], 1.0) if found is not None]
    assert (outcome.status, outcome.error, outcome.attempts) == ("finished", None, 1)
    assert (future.asked, client.submitted) == (asked, submitted)
