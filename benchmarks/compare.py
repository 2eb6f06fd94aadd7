"""Compares the checkout it is started in with an earlier commit of it: what every scenario gives, and what it costs.

It knows the command line and the files of a run folder, and nothing of what is inside the package, so that it serves
while modules move. It works on copies of both trees, so that the checkout may be edited meanwhile.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

TOLERANCE = 1e-9  # of a signal's largest magnitude, and of a metric
RENAMED = {"velocity_bound": "barrier_bound"}  # signals: name in REV, name in the checkout
ADDED: tuple[str, ...] = ()  # signals and metrics that REV may lack, such as "h" or "barriers.*.h_min"
TIMES = ("wall_seconds", "real_time_factor", "*tick_seconds_*")  # metrics that no two runs share
LONG, SHORT = 30.0, 0.01  # walks whose simulating and whose start are timed; the short one is a tick [s]
FIGURES = (  # what a turn measures: (name, unit, how many of it a second has)
    ("control tick of vhip, median", "ms", 1e3),
    ("control tick of vhip, 99 % below", "ms", 1e3),
    (f"simulating {LONG:g} s of walking, 5 ms plant step", "s", 1.0),
    ("starting to walk, up to the log of the first tick", "s", 1.0),
)


class Tree:
    """A copy of the sources, which runs its own command line."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name, self.folder, self.runs = name, folder, folder.with_name(f"{folder.name}-runs")
        project = folder / "pyproject.toml"
        entry = re.search(r'^pdhocbf = "([\w.]+):(\w+)"', project.read_text() if project.is_file() else "", re.M)
        if entry is None:
            raise RuntimeError(f"{name} has no pyproject.toml that says where the command pdhocbf starts")
        self._code = f"import sys; from {entry[1]} import {entry[2]}; sys.exit({entry[2]}())"

    def command(self, *words: str, until: str | None = None) -> str:
        """Runs `pdhocbf WORDS`, no longer than until there is a file of that name; gives what it printed."""
        line, pipe = [sys.executable, "-c", self._code, *words], subprocess.PIPE
        env = {**os.environ, "PYTHONPATH": str(self.folder), "OPENBLAS_NUM_THREADS": "1"}
        child = subprocess.Popen(line, cwd=self.folder, env=env, stdout=pipe, stderr=pipe, text=True)
        while until and child.poll() is None and not any(until in files for _, _, files in os.walk(self.runs)):
            time.sleep(0.002)
        if until:
            child.kill()
        printed, errors = child.communicate()
        if child.returncode not in (0, 3, -9 if until else 0):  # 3: the robot fell
            said = errors.strip().splitlines() or [f"nothing, and ends with {child.returncode}"]
            raise RuntimeError(f"`pdhocbf {' '.join(words[:2])}` of {self.name} says: {said[-1]}")
        return printed

    def run(self, scenario: str, text: str = "{}", until: str | None = None) -> Path:
        """The folder of a scenario's run."""
        self.command("run", scenario, "--no-replay", "--text", text, "--out", str(self.runs / scenario), until=until)
        return self.runs / scenario

    def until_logged(self, duration: float) -> float:
        """Processor time, user and system, of a walk from its process's start to its log, without the report [s]."""
        shutil.rmtree(self.runs, ignore_errors=True)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.run("walking", f"{{plant: {{time_step: 0.005}}, duration: {duration}}}", until="log.npz")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    def turn(self) -> list[float]:
        """Measures each of `FIGURES` once, in fresh processes [s]."""
        vhip, start = metrics(self.run("vhip")), self.until_logged(SHORT)
        median, p99 = (vhip.get(f"mpc.tick_seconds_{which}", np.nan) for which in ("median", "p99"))
        return [median, p99, self.until_logged(LONG) - start, start]


def metrics(folder: Path) -> dict[str, Any]:
    """The metrics of a run by their dotted names."""
    return leaves(json.loads((folder / "metrics.json").read_text(encoding="utf-8")))


def leaves(value: Any, name: str = "") -> dict[str, Any]:
    """What is in a tree of objects and lists, by dotted names."""
    inner = dict(enumerate(value)) if isinstance(value, list) else value
    if not isinstance(inner, dict):
        return {name: value}
    return {leaf: x for key in inner for leaf, x in leaves(inner[key], f"{name}.{key}".lstrip(".")).items()}


def signals(folder: Path) -> dict[str, Any]:
    """The signals of a run by their names, without the solve time."""
    with np.load(folder / "log.npz", allow_pickle=False) as log:
        return {name: np.delete(log[name], 1, axis=1) if name == "solver_status" else log[name] for name in log}


def difference(old: Any, new: Any) -> float:
    """The largest difference over the largest magnitude of the old [-]; inf if shapes, texts or NaNs differ."""
    a, b = np.asarray(old), np.asarray(new)
    if a.shape != b.shape or a.dtype.kind not in "fi" or b.dtype.kind not in "fi":
        return 0.0 if np.array_equal(a, b) else np.inf
    unequal = (a != b) & ~(np.isnan(a) & np.isnan(b))
    apart, scale = np.abs(a[unequal] - b[unequal]).max(initial=0.0), np.abs(a[np.isfinite(a)]).max(initial=0.0)
    return 0.0 if apart == 0.0 else float(apart / scale) if np.isfinite(apart) and scale else np.inf


def differences(old: Path, new: Path) -> dict[str, float]:
    """Relative differences of two runs by signal and metric [-]."""
    found, here = {}, signals(new)
    there = {RENAMED[name] if RENAMED.get(name) in here else name: table for name, table in signals(old).items()}
    for kind, a, b in (("signal", there, here), ("metric", metrics(old), metrics(new))):
        for name in sorted({*a, *b}):
            if name in a and name in b:
                if kind == "signal" or not any(fnmatchcase(name, pattern) for pattern in TIMES):
                    found[f"{kind} {name}"] = difference(a[name], b[name])
            elif name in a or not any(fnmatchcase(name, pattern) for pattern in ADDED):
                found[f"{kind} {name}, {'gone' if name in a else 'new'}"] = np.inf
    return found


def all_same(trees: tuple[Tree, Tree]) -> bool:
    """Runs every scenario of REV in both trees and prints a line for each; whether all are the same."""
    same = True
    for name in [line.split()[0] for line in trees[0].command("list").splitlines()]:
        try:
            with ThreadPoolExecutor() as side_by_side:
                found = differences(*side_by_side.map(Tree.run, trees, (name, name)))
            beyond = [what for what in found if found[what] > TOLERANCE]
            worst = max(found, key=lambda what: found[what])
            told = f"{worst}: {found[worst]:.1e}" if found[worst] else f"all {len(found)} signals and metrics identical"
            told += f" ({len(beyond)} of {len(found)} differ: {', '.join(beyond[:8])})" if beyond else ""
        except RuntimeError as trouble:
            beyond, told = [name], str(trouble)
        print(f"{name:<20} {'DIFFERS' if beyond else 'same':<8} {told}", flush=True)
        same = same and not beyond
    return same


def all_within(trees: tuple[Tree, Tree], repeats: int, limit: float) -> bool:
    """Times both trees in turns and prints the ratios; whether no median ratio is above the limit."""
    for tree in trees:
        tree.turn()  # what is compiled once is compiled here
    turns = np.array([[tree.turn() for tree in trees] for _ in range(repeats)])
    ratios = turns[:, 1] / turns[:, 0]
    for i, (name, unit, factor) in enumerate(FIGURES):
        (old, new), ratio = np.median(turns[:, :, i], axis=0) * factor, np.median(ratios[:, i])
        told = f"new/old {ratio:.3f} ({ratios[:, i].min():.3f} to {ratios[:, i].max():.3f})"
        print(f"{name:<50} {old:.3g} -> {new:.3g} {unit}, {told}{f'  ABOVE {limit:g}' if ratio > limit else ''}")
    return bool((np.median(ratios, axis=0) <= limit).all())


def git(folder: Path, *words: str, otherwise: str) -> str:
    """What git prints; raises `RuntimeError` with the sentence `otherwise`."""
    try:
        return subprocess.run(["git", "-C", str(folder), *words], capture_output=True, check=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError):
        raise RuntimeError(otherwise) from None


def copies(rev: str, scratch: Path) -> tuple[Tree, Tree]:
    """The commit, and the checkout as it is without ignored files; neither in git, which a run would ask."""
    here, old, new, packed = Path.cwd(), scratch / "old", scratch / "new", scratch / "old.zip"
    root = Path(git(here, "rev-parse", "--show-toplevel", otherwise=f"{here} is not in a git checkout").strip())
    git(root, "archive", f"--output={packed}", f"{rev}^{{commit}}", otherwise=f"{root} has no commit {rev}")
    shutil.unpack_archive(packed, old)
    for name in git(root, "ls-files", "-zco", "--exclude-standard", otherwise=f"git cannot list {root}").split("\0"):
        if (root / name).is_file():  # and not deleted
            (new / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, new / name)
    return Tree(rev, old), Tree("the checkout", new)


def main() -> int:
    """Gives exit code 1 if a scenario differs, a median ratio is above the limit, or there is nothing to compare."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("rev", metavar="REV", help="the earlier commit")
    parser.add_argument("--only", choices=("scenarios", "speed"), help="half of it")
    parser.add_argument("--repeats", type=int, default=7, metavar="N", help="pairs of turns that are timed (default 7)")
    parser.add_argument("--limit", type=float, default=np.inf, metavar="RATIO", help="largest median of new/old")
    options = parser.parse_args()
    try:
        with tempfile.TemporaryDirectory(prefix="compare-") as scratch:
            trees = copies(options.rev, Path(scratch))
            same = options.only == "speed" or all_same(trees)
            within = options.only == "scenarios" or all_within(trees, max(options.repeats, 1), options.limit)
            return 0 if same and within else 1
    except (RuntimeError, OSError) as error:
        print(f"compare: {error}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
