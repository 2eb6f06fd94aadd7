"""Every example runs from an empty folder, is short, and prints what it found."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parent.parent / "examples"
WRITTEN = {
    "barrier_on_a_pendulum": [],
    "campaign_of_your_own": ["campaign-example_pushes/report.html", "campaign-example_pushes/runs.parquet"],
    "certify_a_bound": ["example_certify_1/certify.json", "example_certify_1/figures/safe_tube.png"],
    "controller_in_your_diagram": [],
    "controller_without_simulator": [],
    "estimate_from_a_log": [],
    "pass_a_moving_obstacle": [],
    "push_the_robot": ["example_push/push.json", "example_push/push.png"],
    "walk_and_replay": ["example_walk/metrics.json", "example_walk/replay.html", "example_walk/report.html"],
}
SAYS = {
    "barrier_on_a_pendulum": "with the barrier: h is at least 0.000 rad, 0 of 801 ticks below 0",
    "campaign_of_your_own": "of 6 pushes survived",
    "certify_a_bound": "can't be kept, no state is left at phase",
    "controller_in_your_diagram": "801 ticks, of which 0 were not simply solved",
    "controller_without_simulator": "step 9, tick  0",
    "estimate_from_a_log": "RMS error of the CoM's velocity: ",
    "pass_a_moving_obstacle": "it stands, the start is in line: h ≥ 0.0000 m², 2.00 m from the goal, solved",
    "push_the_robot": "N s are survived",
    "walk_and_replay": "finished: walked 0.90 m in 4.0 s",
}


def spent() -> float:
    """Processor time of this process's ended children [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def test_the_promised_examples_exist() -> None:
    assert sorted(path.stem for path in FOLDER.glob("*.py")) == sorted(WRITTEN)


@pytest.mark.parametrize("name", sorted(WRITTEN))
def test_an_example_runs_within_a_minute_and_prints_what_it_found(name: str, tmp_path: Path) -> None:
    if name == "campaign_of_your_own":
        pytest.importorskip("distributed")
        pytest.importorskip("pyarrow")
    paths = os.pathsep.join([str(FOLDER.parent), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": paths}
    before = spent()
    done = subprocess.run(
        [sys.executable, str(FOLDER / f"{name}.py")],
        cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert SAYS[name] in done.stdout
    assert spent() - before < 60.0
    assert [file for file in WRITTEN[name] if not (tmp_path / "runs" / file).is_file()] == []


@pytest.mark.parametrize("name", sorted(WRITTEN))
def test_an_example_says_what_it_does_and_is_short(name: str) -> None:
    lines = (FOLDER / f"{name}.py").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 40
    assert lines[0].startswith('"""')
