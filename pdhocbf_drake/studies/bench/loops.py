"""Whole closed loops: the template against its bare arithmetic, the robot against its bare plant."""

from __future__ import annotations

from cProfile import Profile
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram

from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram, simulate
from pdhocbf_drake.simulation.wiring import Form
from pdhocbf_drake.studies.bench.bare_plant import bare_plant, replayed_plant
from pdhocbf_drake.studies.bench.block_clock import block_clock, robot_clock
from pdhocbf_drake.studies.bench.recording import now, record
from pdhocbf_drake.systems.unbundled import leaf_of

FORMS: tuple[Form, Form] = ("fused", "blocks")
_CHUNK = 0.2  # [s] of simulated time between turns
_SAME = 0.05  # metrics that differ by less than this part are the same


def template_loop(duration: float, repeats: int) -> dict[str, float]:
    """Real-time factor of the template, and the part of its time that is not the controller's arithmetic.

    With the controller as one block, which is what is simulated, and block by block, in turns.
    """
    scenario = load_scenario("vhip", f"duration: {duration}")
    walk = build_walk(scenario)
    loops, plain = [], []
    for _ in range(repeats):
        pair = [_started(make_diagram(scenario, form=form).diagram) for form in FORMS]
        loops.append([_advanced(simulator, duration) for simulator in pair])
        start = now()
        standing = (scenario.gait.start_steps + 2) * scenario.gait.ticks_per_step
        record(walk, round(duration / scenario.tick) - standing, perturbed=False)
        plain.append(now() - start)
    (wall, blocks), least = np.median(loops, axis=0).tolist(), float(np.median(plain))
    return {
        "simulated_seconds": duration,
        "wall_seconds": wall,
        "real_time_factor": duration / wall,
        "blocks_over_fused": blocks / wall,
        "framework_share": 1.0 - least / wall,
    }


def robot_loop(duration: float, plant_step: float) -> dict[str, Any]:
    """The walking robot, the same plant standing, and the same plant walking from a recording, in turns.

    The robot twice, with its controller as one block, which is what is simulated, and block by block. All are timed
    from the first step on. The last one holds no Python: its time is the least that the loop can take with any
    controller.
    """
    scenario = load_scenario("walking", f"plant: {{time_step: {plant_step}}}")
    walk, robot = build_walk(scenario), Biped.load(scenario.robot)
    logged = make_diagram(scenario)
    recording = _started(logged.diagram)
    standing = scenario.gait.start_steps * scenario.gait.ticks_per_step * scenario.tick
    recording.AdvanceTo(standing + duration)
    replayed = replayed_plant(scenario, walk, robot, logged.recorded(recording.get_context()))
    forms = [make_diagram(scenario, form=form).diagram for form in FORMS]
    four = [_started(diagram) for diagram in (*forms, bare_plant(scenario, walk, robot), replayed)]
    for simulator in four:
        simulator.AdvanceTo(standing)
    walls = np.array([[_advanced(simulator, _CHUNK) for simulator in four] for _ in range(round(duration / _CHUNK))])
    fused, block_by_block, bare, replay = (np.median(walls, axis=0) / (_CHUNK / scenario.tick)).tolist()
    over_bare = np.median(walls / walls[:, 2:3], axis=0).tolist()
    return {
        "plant_step": plant_step,
        "robot_over_bare_plant": over_bare[0],
        "replayed_over_bare_plant": over_bare[3],
        "replayed_over_robot": float(np.median(walls[:, 3] / walls[:, 0])),
        "blocks_over_fused": float(np.median(walls[:, 1] / walls[:, 0])),
        "loop_seconds_per_tick": fused,
        "blocks_seconds_per_tick": block_by_block,
        "bare_plant_seconds_per_tick": bare,
        "replayed_plant_seconds_per_tick": replay,
        **calls(scenario, min(duration, 2.0)),
        "blocks": blocks(scenario, min(duration, 4.0)),
    }


def _started(diagram: Diagram) -> Simulator:
    simulator = Simulator(diagram)
    simulator.Initialize()
    return simulator


def _advanced(simulator: Simulator, by: float) -> float:
    """The time that simulating `by` seconds takes [s]."""
    start = now()
    simulator.AdvanceTo(simulator.get_context().get_time() + by)
    return now() - start


def _warm(scenario: Scenario, form: Form = "blocks") -> Simulator:
    """A simulation one second after its start, with every program compiled, so that each tick costs the same."""
    diagram = make_diagram(scenario, form=form).diagram
    leaf_of(diagram.GetSubsystemByName("mpc_controller")).mpc.prepare()
    simulator = _started(diagram)
    simulator.AdvanceTo(1.0)
    return simulator


def calls(scenario: Scenario, duration: float) -> dict[str, float]:
    """Calls from Python in a tick, block by block, and the time of kinematics and dynamics of the robot in them [s].

    The calls are those that Python's profiler counts: with pybind11 (Drake before 1.52) those into Drake as well.
    """
    ticks = duration / scenario.tick
    simulator, profile = _warm(scenario), Profile()
    profile.runcall(_advanced, simulator, duration)
    with robot_clock() as clock:
        simulator = _warm(scenario)
        clock.clear()
        _advanced(simulator, duration)
    return {
        "python_calls_per_tick": float(sum(entry.callcount for entry in profile.getstats()) / ticks),
        "kinematics_seconds_per_tick": clock.seconds.get("robot", 0.0) / ticks,
    }


def blocks(scenario: Scenario, duration: float) -> dict[str, float]:
    """Seconds of a tick by block; "plant and framework" is the rest of the whole."""
    with block_clock() as clock:
        simulator = _warm(scenario)
        clock.clear()
        wall = _advanced(simulator, duration)
        spent = dict(clock.seconds)
    ticks = duration / scenario.tick
    parts = {name: seconds / ticks for name, seconds in sorted(spent.items(), key=lambda item: -item[1])}
    return parts | {"plant and framework": (wall - sum(spent.values())) / ticks}


def estimator_over_mpc_tick(duration: float) -> float:
    """The time of the estimator's block in a walk on sensors, over that of the MPC's solve of x and y."""
    parts = blocks(load_scenario("walking_sensors"), duration)
    return parts["BaseEstimator"] / parts["PeriodicMpc"]


def plant_steps(steps: list[float], duration: float) -> list[dict[str, Any]]:
    """The walk at several plant steps: whether it is the same walk as at the first one, and its speed."""
    rows: list[dict[str, Any]] = []
    for step in steps:
        scenario = load_scenario("walking", f"{{duration: {duration}, plant: {{time_step: {step}}}}}")
        start = now()
        log = simulate(scenario)
        metrics = compute_metrics(scenario, log, now() - start, None)
        controller, tick = float("nan"), float("nan")
        if not metrics.fell:
            parts = blocks(scenario, min(duration - 1.0, 3.0))
            controller = sum(parts.values()) - parts["plant and framework"]
            simulator, chunks = _warm(scenario, "fused"), round((duration - 1.0) / _CHUNK)
            walls = [_advanced(simulator, _CHUNK) for _ in range(chunks)]
            tick = float(np.median(walls)) / (_CHUNK / scenario.tick)
        row = {name: getattr(metrics, name) for name in ("fell", "mean_speed", "zmp_outside_fraction", "com_rms_error")}
        row |= {
            "plant_step": step,
            "h_min": min((b.h_min for b in metrics.barriers.values() if b.h_min is not None), default=None),
            "controller_seconds_per_tick": controller,
            "plant_seconds_per_tick": tick - controller,
            "real_time_factor": scenario.tick / tick,
        }
        rows.append(row)
        row["same_walk"] = not metrics.fell and same_walk(rows[0], row)
    return rows


def same_walk(first: dict[str, Any], other: dict[str, Any]) -> bool:
    """The same speed to 5 %; tracking, safety and ZMP not worse than by 5 mm, 5 mm/s and 2 % of the ticks."""
    speed = abs(other["mean_speed"] - first["mean_speed"]) <= _SAME * abs(first["mean_speed"])
    pairs = zip(first["com_rms_error"], other["com_rms_error"], strict=True)
    tracking = all(b is None or b <= a + 0.005 for a, b in pairs)
    zmp = other["zmp_outside_fraction"] <= first["zmp_outside_fraction"] + 0.02
    kept = first["h_min"] is None or other["h_min"] >= first["h_min"] - 0.005
    return bool(speed and tracking and zmp and kept)
