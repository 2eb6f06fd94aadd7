"""The settled walk under each constant command of a scenario."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.kept import Kept
from pdhocbf_drake.mpc.commanded_orbit import settling
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.command_limits import Limits
from pdhocbf_drake.walking.commanded_walk import CommandedFootsteps
from pdhocbf_drake.walking.commands import Command
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.sole_gap import Pose

_MOST = 256
_ORIGIN = Pose(0.0, 0.0, 0.0)


class ConstantWalks:
    """Orbits of walks by their command, each walked on the template when it is first asked for, in some 20 ms.

    Args:
        mpc: of a walk that nothing disturbs, without barriers and without an end; its programs serve all commands.
        limits: what legs and soles allow.
    """

    def __init__(self, mpc: PeriodicMpc, limits: Limits) -> None:
        self._mpc, self._limits, self._kept = mpc, limits, Kept[np.ndarray | InputError](_MOST)
        self._expected = Kept[Iterator[np.ndarray | None]](1)

    def prepare(self, command: Command) -> None:
        """Walks under a command; raises `InputError` where that can't be walked for ever."""
        if isinstance(orbit := self._orbit(command), InputError):
            raise orbit

    def expect(self, command: Command) -> None:
        """Walks a step, some 2 ms, under a command that will be taken up, so that no tick has to walk them all."""
        if command not in self._kept and (orbit := self._further(command)) is not None:
            self._kept.get(command, lambda: orbit)

    def __call__(self, command: Command) -> np.ndarray | None:
        """As `CommandOrbits.of`: None where the command can't be walked for ever."""
        orbit = self._orbit(command)
        return None if isinstance(orbit, InputError) else orbit

    def _orbit(self, command: Command) -> np.ndarray | InputError:
        def make() -> np.ndarray | InputError:
            while (orbit := self._further(command)) is None:
                pass
            return orbit

        return self._kept.get(command, make)

    def _further(self, command: Command) -> np.ndarray | InputError | None:
        """The orbit, or why there is none, after one step more; None where the walk has not settled yet."""
        try:
            return next(self._expected.get(command, lambda: self._settling(command)))
        except InputError as error:
            return error

    def _settling(self, command: Command) -> Iterator[np.ndarray | None]:
        gait = constant_walk(self._mpc.gait.config, command, self._limits)
        return settling(self._mpc.walking(lambda _: gait))


def constant_walk(config: GaitConfig, command: Command, limits: Limits) -> Gait:
    """The walk from a stand at the origin under one command."""
    return Gait(config, CommandedFootsteps.of(config, lambda time: command, _ORIGIN, limits))
