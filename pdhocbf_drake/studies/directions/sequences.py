"""Random sequences of commands, stops and starts among them: those of the campaign `walking_commands`."""

from __future__ import annotations

from typing import Any, Final

from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.studies.shared.checks import Check, Outcome, least
from pdhocbf_drake.studies.shared.command_sequences import drawn_sequence, packaged_sequence
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work, fallen, upright, walked

ROW: Final = "random"
_QUICK = 6.0  # [s]
_SAFE = 99.5  # [%]


def plan(row: str, asked: Asked) -> list[Work]:
    """A walk for each sequence."""
    sequence = packaged_sequence()
    if asked.quick:
        sequence = sequence.model_copy(update={"until": _QUICK})
    text = sequence.model_dump(mode="json")
    setting, walks = {"sequence": text, "seed": asked.numbers["seed"]}, range(asked.numbers["walks"])
    return [Work(row, asked.scenario, {**setting, "draw": draw}) for draw in walks]


def measure(work: Work) -> Outcome:
    """Walks one sequence."""
    asked: dict[str, Any] = dict(work.setting)
    commands, until = drawn_sequence(asked["sequence"], asked["seed"], asked["draw"])
    scenario = work.with_keys(duration=until, commands=commands)
    log, metrics = walked(scenario)
    judged = len(log.after(scenario.from_time))
    name = f"sequence {asked['draw']} of seed {asked['seed']}"
    return Outcome([*upright(ROW, metrics), *safe_ticks(metrics, judged)], fallen(name, metrics))


def safe_ticks(metrics: Metrics, judged: int) -> list[Check]:
    """The share of the ticks from `from_time` on with h ≥ 0, of each barrier."""
    return [
        least(
            ROW, f"ticks with h of {name} ≥ 0",
            None if barrier.violations is None or not judged else 100.0 * (1.0 - barrier.violations / judged),
            _SAFE, "%",
        )._replace(combine="mean")
        for name, barrier in metrics.barriers.items()
    ]  # fmt: skip
