"""A walk whose barriers are changed while it goes on: its bounds by their settings, and its MPC by γ."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pdhocbf_drake.kept import Kept
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.walking.barrier_changes import BarrierSettings, Setting
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig
from pdhocbf_drake.walking.walk_barrier import BoundChanges, WalkBarrier

_BOUNDS = 32  # of the last settings that are kept

Made = Callable[[str, WalkBarrierConfig], WalkBarrier]


def changing(scenario: Scenario, barriers: Sequence[WalkBarrier], make: Made) -> BarrierSettings:
    """Lets the bounds of the barriers of a scenario follow settings that can be added to; none are so far.

    Args:
        make: a barrier from its name and its config; raises `InputError`.
    """
    settings = BarrierSettings(scenario.barriers, scenario.tick)
    for place, (barrier, (name, config)) in enumerate(zip(barriers, scenario.barriers.items(), strict=True)):
        kept = Kept[WalkBarrier](_BOUNDS)

        def of(
            setting: Setting, kept: Kept[WalkBarrier] = kept, name: str = name, config: WalkBarrierConfig = config
        ) -> WalkBarrier:
            return kept.get(setting[:2], lambda: make(name, setting.bound(config)))

        barrier.changes = BoundChanges(settings, place, of)
    return settings


def changing_problem(
    make: Callable[[Sequence[WalkBarrier]], PeriodicMpc], barriers: Sequence[WalkBarrier], settings: BarrierSettings
) -> PeriodicMpc:
    """The MPC with the barriers as they are at the start, which has that of each other γ besides.

    Whatever is added to the settings is made first, with its programs, so that a change that can't be is refused.
    """
    own = make(barriers)
    problems = {_gammas(settings.at(0)): own}

    def prepare(after: Sequence[Setting]) -> None:
        for barrier, setting in zip(barriers, after, strict=True):
            if setting.kind != "none" and barrier.changes is not None:
                barrier.changes.barrier(setting)
        gammas = _gammas(after)
        if gammas not in problems:
            other = [barrier.with_class_k(gamma) for barrier, gamma in zip(barriers, gammas, strict=True)]
            problems[gammas] = make([barrier for barrier in other if isinstance(barrier, WalkBarrier)])

    settings.prepare, own.settings = prepare, settings
    own.changing = lambda tick: problems[_gammas(settings.at(tick))]
    return own


def add_changes(scenario: Scenario, settings: BarrierSettings) -> None:
    """Adds those of a scenario, in the order of their times; raises `InputError`."""
    for i, change in sorted(enumerate(scenario.barrier_changes), key=lambda pair: pair[1].time):
        settings.add(change, f"barrier_changes.{i}")


def _gammas(settings: Sequence[Setting]) -> tuple[tuple[float, ...], ...]:
    return tuple(setting.gamma for setting in settings)
