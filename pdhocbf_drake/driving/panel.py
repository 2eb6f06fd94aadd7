"""The controls of a drive in Meshcat: sliders, keys, buttons and a gamepad."""

from __future__ import annotations

import math
from typing import Final

from pydrake.geometry import Meshcat

from pdhocbf_drake.driving.barrier_sliders import BarrierSliders, said_of
from pdhocbf_drake.driving.controls import SIDES, Asked, Pushed
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.walking.commands import STOP, Command

# Name with its keys: (least, largest, step, keys for less and for more) [m/s, m/s, rad/s]. Commands come in few steps,
# since each has an orbit of its own.
SLIDERS: Final = {
    "forward (S W)": (-0.2, 0.4, 0.05, "KeyS", "KeyW"),
    "sideways (D A)": (-0.15, 0.15, 0.05, "KeyD", "KeyA"),
    "turn (E Q)": (-0.6, 0.6, 0.1, "KeyE", "KeyQ"),
}
STRENGTH: Final = "push [N s]"
WALK, PAUSE, RESTART, END = "stand / walk (Space)", "pause (P)", "restart (R)", "end"
_BUTTONS = {WALK: "Space", PAUSE: "KeyP", RESTART: "KeyR", END: ""}
AT_FIRST: Final = 0.1
"""The share of the strongest push that a push has at first: `vhip` survives it at each tenth of a second of a gait."""
_DEAD = 0.15  # share of a stick's way that counts as none


def strongest_push(scenario: Scenario) -> float:
    """An impulse that no walk of the scenario's robot survives: three times 0.12 m √(g h) [N s]."""
    mass = Biped.load(scenario.robot).mass if scenario.system == "biped" else scenario.vhip.mass
    return round(0.36 * mass * math.sqrt(9.81 * scenario.gait.com_height), 1)


class Panel:
    """Reads the controls.

    Args:
        scenario: that is driven.
        strongest: the largest impulse of a push [N s].
    """

    def __init__(self, meshcat: Meshcat, scenario: Scenario, strongest: float) -> None:
        self._meshcat = meshcat
        for name, (least, largest, step, less, more) in SLIDERS.items():
            meshcat.AddSlider(name, least, largest, step, 0.0, less, more)
        meshcat.AddSlider(STRENGTH, 0.0, strongest, strongest / 20, strongest * AT_FIRST)
        for name, key in _BUTTONS.items():
            meshcat.AddButton(name, key)
        for side in SIDES:
            meshcat.AddButton(f"push {side}")
        self._barriers = [
            BarrierSliders(meshcat, name, said, scenario.barriers[name])
            for name, said in said_of(scenario.barriers).items()
        ]
        self._clicks = dict.fromkeys([*_BUTTONS, *(f"push {side}" for side in SIDES)], 0)
        self._walks = self._paused = False

    def read(self) -> Asked:
        """What is asked for now; a click counts once."""
        pushes = tuple(
            Pushed(side, self._meshcat.GetSliderValue(STRENGTH))
            for side in SIDES
            for _ in range(self._new_clicks(f"push {side}"))
        )
        way = [round(self._meshcat.GetSliderValue(name), 6) for name in SLIDERS]
        stick = self._stick()
        self._walks ^= self._new_clicks(WALK) % 2 == 1
        self._paused ^= self._new_clicks(PAUSE) % 2 == 1
        if any(stick):
            way = stick
        command = Command(*way) if self._walks or any(way) else STOP
        restarts, ends = self._new_clicks(RESTART) > 0, self._new_clicks(END) > 0
        if restarts:
            self._walks = self._paused = False
            for name in SLIDERS:
                self._meshcat.SetSliderValue(name, 0.0)
            for sliders in self._barriers:
                sliders.reset()
        kept = tuple(change for sliders in self._barriers if (change := sliders.read()) is not None)
        return Asked(command, pushes, kept, self._paused, restarts, ends)

    def _new_clicks(self, name: str) -> int:
        clicks = self._meshcat.GetButtonClicks(name)
        new, self._clicks[name] = clicks - self._clicks[name], clicks
        return new

    def _stick(self) -> list[float]:
        """Forward, sideways and turn of a gamepad's sticks, in the sliders' steps; zeros without one."""
        pad = self._meshcat.GetGamepad()
        if pad.index is None or len(pad.axes) < 3:
            return [0.0] * 3
        left_x, left_y, right_x = pad.axes[:3]
        way = []
        for share, (least, largest, step, *_) in zip((-left_y, -left_x, -right_x), SLIDERS.values(), strict=True):
            size = 0.0 if abs(share) < _DEAD else share * (largest if share > 0.0 else -least)
            way.append(round(round(size / step) * step, 6))
        return way
