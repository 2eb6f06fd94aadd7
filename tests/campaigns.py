"""A small campaign on a template that builds fast, and the command that runs it, for the tests of campaigns."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import yaml

TINY = {
    "scenario": "vhip_nobarrier",
    "seed": 3,
    "runs": 6,
    "overrides": {
        "duration": 0.4,
        "gait": {"ticks_per_step": 10, "double_support_ticks": 1, "stride": 0.02, "com_height_amplitude": 0.002},
        "mpc": {"horizon": 20, "freeze_ticks": 2},
        "pushes": [{"time": 0.1, "force": [0.0, 0.0, 0.0]}],
    },
    "barriers": {
        "none": {},
        "limited": {"barriers": {"speed": {"bound": {"kind": "constant", "value": 3.0}}}},
    },
    "factors": {
        "pushes.0.force.0": {"low": -20.0, "high": 20.0, "unit": "N"},
        "barriers.speed.gamma.0": {"values": [0.2, 0.5]},
    },
}


def campaign_file(folder: Path, **changes: object) -> Path:
    path = folder / "tiny.yaml"
    path.write_text(yaml.safe_dump({**TINY, **changes}, sort_keys=False), encoding="utf-8")
    return path


def start(*words: object, preamble: str = "") -> subprocess.Popen[str]:
    """`pdhocbf WORDS` as a process of its own group; `preamble` is Python that runs before it."""
    # Where the preamble limits what can be written, coverage could not write its data either.
    environment = {name: value for name, value in os.environ.items() if not (preamble and name.startswith("COVERAGE_"))}
    code = f"{preamble}\nimport sys\nfrom pdhocbf_drake.cli import main\nsys.exit(main(sys.argv[1:]))"
    return subprocess.Popen(
        [sys.executable, "-c", code, *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**environment, "OPENBLAS_NUM_THREADS": "1"},
        start_new_session=True,
    )


def finish(process: subprocess.Popen[str], seconds: float = 240.0) -> tuple[int, str, str]:
    """(exit code, standard output, standard error) of a process that must not show a traceback."""
    out, err = process.communicate(timeout=seconds)
    assert "Traceback" not in out + err, err
    return process.returncode, out, err
