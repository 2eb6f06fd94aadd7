"""The settled walk under each constant command of a scenario."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.kept import Kept
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.orbit import commanded_orbit
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.command_limits import Limits
from pdhocbf_drake.walking.commanded_walk import CommandedFootsteps
from pdhocbf_drake.walking.commands import Command
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.sole_gap import Pose

_MOST = 256
_ORIGIN = Pose(0.0, 0.0, 0.0)


class ConstantWalks:
    """Orbits of walks by their command, each walked on the template when it is first asked for: some 0.1 s.

    Args:
        mpc: of a walk that nothing disturbs, without barriers and without an end; its programs serve all commands.
        limits: what legs and soles allow.
    """

    def __init__(self, mpc: PeriodicMpc, limits: Limits) -> None:
        self._mpc, self._limits, self._kept = mpc, limits, Kept[np.ndarray | None](_MOST)

    def prepare(self, command: Command) -> None:
        """Walks under a command; raises `InputError` where that can't be walked for ever."""
        self._kept.get(command, lambda: self._orbit(command))

    def __call__(self, command: Command) -> np.ndarray | None:
        """As `CommandOrbits.of`: None where the command can't be walked for ever."""

        def make() -> np.ndarray | None:
            try:
                return self._orbit(command)
            except InputError:
                return None

        return self._kept.get(command, make)

    def _orbit(self, command: Command) -> np.ndarray:
        gait = constant_walk(self._mpc.gait.config, command, self._limits)
        return commanded_orbit(gait, self._mpc.walking(lambda _: gait))


def constant_walk(config: GaitConfig, command: Command, limits: Limits) -> Gait:
    """The walk from a stand at the origin under one command."""
    return Gait(config, CommandedFootsteps.of(config, lambda time: command, _ORIGIN, limits))
