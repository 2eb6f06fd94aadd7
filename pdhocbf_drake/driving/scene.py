"""The scene of a drive: that of a replay, drawn from the signals of the present tick."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pdhocbf_drake.analysis.plan_frame import present_over_stance
from pdhocbf_drake.analysis.replay_markers import Foothold, Frame, Markers, add_foothold
from pdhocbf_drake.analysis.replay_scenes import pendulum, posed_robot
from pdhocbf_drake.analysis.replay_stage import Stage
from pdhocbf_drake.driving.barrier_sliders import said_of
from pdhocbf_drake.driving.session import Signals
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.systems.signals import places
from pdhocbf_drake.walking import Gait

_FOLLOWED = 0.05  # share of its way to the walk that the view goes from picture to picture
_FOOTHOLDS = 24  # the last ones that are shown
_LATE = "late ticks [%]"
_GROUND = 12.0  # shown around the start [m]
_USUAL = 0.03  # h of a barrier that is as safe as usual, where its bound has no margin [unit of h]
_YAW, _TURN = places("path", "yaw", "turn")
_STEP, _SUPPORT = places("gait_phase", "step", "support")
_NOW = places("stance_plan", "x_now", "y_now")


def live_scene(scenario: Scenario) -> tuple[LiveScene, str]:
    """A scene of its own for a walk that is watched, and its address."""
    stage = Stage(None)
    return LiveScene(stage, scenario), stage.meshcat.web_url()


class LiveScene:
    """Draws the walk of a drive on a live stage.

    Args:
        stage: a live one.
        scenario: that is driven.
    """

    def __init__(self, stage: Stage, scenario: Scenario) -> None:
        self._stage, self._gait = stage, Gait(scenario.gait)
        self._names = [
            f"h {said} [{scenario.barriers[name].unit}]" for name, said in said_of(scenario.barriers).items()
        ]
        self._usual = np.array([barrier.bound.margin or _USUAL for barrier in scenario.barriers.values()])
        half = self._gait.region.half(self._gait.support(scenario.gait.start_steps))
        self._pose: Callable[[Signals], None]
        if scenario.system == "biped":
            biped = Biped.load(scenario.robot)
            half = np.asarray(biped.soles["left"].half_size)
            pose, count = posed_robot(stage, biped)
            self._pose = lambda signals: pose(signals["robot_state"][:count], 0.0)
        else:
            place = pendulum(stage, 0.8 * (scenario.gait.com_height - scenario.gait.com_height_amplitude))
            self._pose = lambda signals: place(signals["lip_state"], float(signals["com_height"][0]))
        for name, usual in zip(self._names, self._usual.tolist(), strict=True):
            stage.meshcat.AddSlider(name, -2.0 * usual, 6.0 * usual, 1e-5, 0.0)
        stage.meshcat.AddSlider(_LATE, 0.0, 100.0, 0.1, 0.0)
        self._half, self._terrain = half, scenario.terrain
        self._markers = Markers(stage, half, self._terrain)
        stage.ground(-_GROUND, _GROUND, -_GROUND, _GROUND, self._terrain)
        self._view: np.ndarray | None = None
        self._step, self._taken = -1, 0

    def draw(self, signals: Signals, late: float = 0.0) -> None:
        """Draws a tick, and shows h and a share of late ticks; a walk that begins anew is followed from its start."""
        signals = present_over_stance(signals)
        step, support = signals["gait_phase"][[_STEP, _SUPPORT]]
        yaw = float(signals["path"][_YAW]) if "path" in signals else 0.0
        for name, h in zip(self._names, signals["h"].tolist() if self._names else (), strict=True):
            self._stage.meshcat.SetSliderValue(name, h)
        self._stage.meshcat.SetSliderValue(_LATE, 100.0 * late)
        if step < self._step:
            self._view = None
        if step != self._step and support:
            side, here = "left" if support > 0 else "right", signals["stance_plan"][list(_NOW)]
            foothold = Foothold(0, side, here, self._half, yaw)
            add_foothold(self._stage, self._taken % _FOOTHOLDS, foothold, self._terrain)
            self._taken += 1
        self._step = round(step)
        self._pose(signals)
        self._markers.draw(self._frame(signals, yaw))

    def _frame(self, signals: Signals, yaw: float) -> Frame:
        state = signals["lip_state"]
        here = np.array([state[0], state[3], yaw])
        self._view = here if self._view is None else self._view + _FOLLOWED * (here - self._view)
        turn = (
            (float(signals["path"][_TURN]) if "path" in signals else 0.0) * self._gait.period * self._gait.config.tick
        )
        height = float(signals["com_height"][0])
        com_z = float(signals["com_z"][0]) if "com_z" in signals else height
        drawn = {
            name: signals[name] for name in ("lip_state", "com_reference", "zmp_reference", "zmp_box", "stance_plan")
        }
        safety = float(np.clip(np.min(signals["h"] / self._usual), 0.0, 1.0)) if len(self._usual) else None
        headings = np.array([yaw, yaw + turn, yaw + 2.0 * turn])
        return Frame(**drawn, com_z=com_z, com_height=height, headings=headings, view=self._view, safety=safety)
