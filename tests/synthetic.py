"""Logs made by formula, whose metrics are known."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.barriers import harmonic
from pdhocbf_drake.simulation.provenance import Provenance
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import FINISHED, RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.systems.signals import LOGGED

N, START, STRIDE, WIDTH, TICK, H = 40, 2, 0.15, 0.16, 0.01, 80
SPEED = STRIDE / (N * TICK)
RIPPLE = 0.05
MARGIN = 0.02

BARRIER = {
    "bound": {"kind": "harmonic", "mean": SPEED + MARGIN, "cosine": RIPPLE, "sine": 0.0},
    "gamma": [0.5, 0.5],
}


def scenario(system: str = "biped", duration: float = 4.0) -> Scenario:
    """A walk under one barrier that its velocity keeps a distance of exactly MARGIN from."""
    barriers = {} if system == "van_der_pol" else {"forward_speed": BARRIER}
    data = {"name": "synthetic", "system": system, "duration": duration, "barriers": barriers}
    return Scenario.from_dict(data, "synthetic")


def walk_log(robot: bool = True, duration: float = 4.0, ending: str = FINISHED) -> RunLog:
    """A walk at constant mean speed with a cosine ripple; the feet step on a 0.15 m grid."""
    ticks = np.arange(round(duration / TICK) + 1)
    time = ticks * TICK
    step, phase = ticks // N, ticks % N
    first = step < START
    support = np.where(first, 0, np.where((step - START) % 2 == 0, -1, 1))
    angle = 2 * np.pi * phase / N
    velocity = SPEED + RIPPLE * np.cos(angle)
    x = SPEED * time + RIPPLE * N * TICK / (2 * np.pi) * np.sin(angle)
    y = 0.03 * np.sin(np.pi * ticks / N)
    ahead = np.maximum(step - START, 0)
    stance = np.stack([STRIDE * ahead, np.where(first, 0.0, np.sign(support) * WIDTH / 2)], axis=1)
    zero = np.zeros(len(ticks))
    bound = harmonic(SPEED + MARGIN, RIPPLE, 0.0, N)
    bounds = np.array([bound.samples(int(k), H + 1) for k in ticks])
    stances = np.stack([stance + np.array([STRIDE * j, 0.0]) for j in (-1, 0, 1, 2)], axis=1).reshape(-1, 8)
    stances[:, [1, 5]] *= -1
    signals = {
        "gait_phase": np.stack([phase, step, support], axis=1),
        "com_height": np.stack([0.58 + 0.01 * np.cos(angle), zero, zero], axis=1),
        "zmp_box": np.stack(
            [stance[:, 0] - 0.05, stance[:, 0] + 0.05, stance[:, 1] - 0.05, stance[:, 1] + 0.05], axis=1
        ),
        "barrier_bound": bounds,
        "h": (bounds[:, 0] - velocity)[:, None],
        "lip_state": np.stack([x, velocity, stance[:, 0], y, zero, stance[:, 1]], axis=1),
        "com_reference": np.stack([x + 0.003, velocity, zero, y - 0.004, zero, zero], axis=1),
        "zmp_reference": np.stack([stance[:, 0], zero, stance[:, 1], zero], axis=1),
        "stance_plan": stances,
        "solver_status": np.tile([1.0, 1e-4, 0.5, 0.0, 0.0, 0.0], (len(ticks), 1)),
    }
    if robot:
        signals |= _robot_signals(ticks, step, phase, support, x, y)
    return RunLog(signals, time, ending)


def _robot_signals(ticks, step, phase, support, x, y):
    rows = len(ticks)
    feet = np.zeros((rows, 12))
    for column, side in ((0, 1), (6, -1)):
        # A foot stands where its last step put it: the gait's own steps are `walked` steps after the start.
        walked = np.maximum(step - START, -1)
        own = np.where(support == side, walked, walked - 1)
        standing = STRIDE * np.maximum(own, 0) * (walked >= 0)
        swings = (support == -side) & (walked >= 0)
        target = STRIDE * (walked + 1)
        s = phase / N
        feet[:, column] = np.where(swings, standing + (target - standing) * s, standing)
        feet[:, column + 1] = side * WIDTH / 2
        feet[:, column + 2] = np.where(swings, 0.05 * 64 * s**3 * (1 - s) ** 3, 0.0)
    joints = np.zeros((rows, 24))
    joints[:, :12] = 0.1 * np.sin(2 * np.pi * ticks / (2 * N))[:, None]
    state = np.zeros((rows, 37))
    state[:, 0] = 1.0
    state[:, 4], state[:, 5], state[:, 6] = x, y, 0.6
    state[:, 7:19] = [0, 0, -0.5, 1.0, -0.5, 0, 0, 0, -0.5, 1.0, -0.5, 0]
    contact = np.zeros((rows, 18))
    contact[:, 5] = 284.0  # below the origin of the base
    return {
        "com_z": np.stack([0.585 + 0.01 * np.cos(2 * np.pi * phase / N), np.zeros(rows)], axis=1),
        "foot_state": feet,
        "joint_state": joints,
        "foot_reference": np.zeros((rows, 18)),
        "desired_state": joints,
        "feedforward": np.zeros((rows, 12)),
        "actuation": np.full((rows, 12), 10.0),
        "push": np.zeros((rows, 3)),
        "robot_state": state,
        "contact_forces": contact,
    }


def oscillator_log(duration: float = 4.0) -> RunLog:
    """A state at the centre of its tube."""
    time = np.arange(round(duration / TICK) + 1) * TICK
    state = np.stack([np.cos(time), -np.sin(time)], axis=1)
    signals = {
        "oscillator_state": state,
        "oscillator_input": np.zeros((len(time), 1)),
        "h": np.full((len(time), 4), 0.1),
    }
    return RunLog(signals, time)


def run(system: str = "biped", duration: float = 4.0, ending: str = FINISHED) -> Run:
    """A whole run without a simulation."""
    log = oscillator_log(duration) if system == "van_der_pol" else walk_log(system == "biped", duration, ending)
    return Run(scenario(system, duration), log, provenance())


def pushed(given: Run, *pushes: dict[str, object], **keys: object) -> Run:
    """The run as one whose scenario has these pushes and other keys; its log stays as it is."""
    scenario = Scenario.from_dict(given.scenario.to_dict() | {"pushes": pushes, **keys}, "pushed")
    return given._replace(scenario=scenario)


def provenance() -> Provenance:
    """Any provenance."""
    return Provenance(
        pdhocbf_drake="0.1.0", commit=None, modified=None, python="3.11", packages={}, machine="m", processor="p",
        cores=1, seed=0, started="2026-01-01T00:00:00+00:00", wall_seconds=2.0,
    )  # fmt: skip


def signal_names() -> set[str]:
    """The names of all logged signals."""
    return {signal.name for signal in LOGGED}
