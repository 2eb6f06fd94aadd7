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
from pdhocbf_drake.studies.bench.bare_plant import bare_plant, replayed_plant
from pdhocbf_drake.studies.bench.block_clock import block_clock, drake_clock
from pdhocbf_drake.studies.bench.clock import now
from pdhocbf_drake.studies.bench.recording import record
from pdhocbf_drake.systems.unbundled import leaf_of

_CHUNK = 0.2  # [s] of simulated time between turns
_SAME = 0.05  # metrics that differ by less than this part are the same


def template_loop(duration: float, repeats: int) -> dict[str, float]:
    """Real-time factor of the template's diagram, and the part of its time that is not the controller's arithmetic."""
    scenario = load_scenario("vhip", f"duration: {duration}")
    walk = build_walk(scenario)
    loops, plain = [], []
    for _ in range(repeats):
        simulator = Simulator(make_diagram(scenario).diagram)
        simulator.Initialize()
        start = now()
        simulator.AdvanceTo(duration)
        loops.append(now() - start)
        start = now()
        standing = (scenario.gait.start_steps + 2) * scenario.gait.ticks_per_step
        record(walk, round(duration / scenario.tick) - standing, perturbed=False)
        plain.append(now() - start)
    wall, least = float(np.median(loops)), float(np.median(plain))
    return {
        "simulated_seconds": duration,
        "wall_seconds": wall,
        "real_time_factor": duration / wall,
        "framework_share": 1.0 - least / wall,
    }


def robot_loop(duration: float) -> dict[str, Any]:
    """The walking robot, the same plant standing, and the same plant walking from a recording, in turns.

    All at a plant step of 1 ms, and timed from the first step on. The last one holds no Python: less than it costs, no
    controller can make the loop.
    """
    scenario = load_scenario("walking", "plant: {time_step: 0.001}")
    walk = build_walk(scenario)
    robot = Biped.load(scenario.robot)
    logged = make_diagram(scenario)
    recording = _started(logged.diagram)
    standing = scenario.gait.start_steps * scenario.gait.ticks_per_step * scenario.tick
    recording.AdvanceTo(standing + duration)
    replayed = replayed_plant(scenario, walk, robot, logged.recorded(recording.get_context()))
    three = [_started(diagram) for diagram in (logged.diagram, bare_plant(scenario, walk, robot), replayed)]
    for simulator in three:
        simulator.AdvanceTo(standing)
    walls = np.array([[_advanced(simulator, _CHUNK) for simulator in three] for _ in range(round(duration / _CHUNK))])
    ticks = _CHUNK / scenario.tick
    loop, bare, replay = np.median(walls, axis=0)
    over_bare = np.median(walls / walls[:, 1:2], axis=0)
    return {
        "robot_over_bare_plant": float(over_bare[0]),
        "replayed_over_bare_plant": float(over_bare[2]),
        "loop_seconds_per_tick": float(loop / ticks),
        "bare_plant_seconds_per_tick": float(bare / ticks),
        "replayed_plant_seconds_per_tick": float(replay / ticks),
        **calls(scenario, min(duration, 2.0)),
        "blocks": blocks(scenario, min(duration, 4.0)),
    }


def _started(diagram: Diagram) -> Simulator:
    simulator = Simulator(diagram)
    simulator.Initialize()
    return simulator


def _advanced(simulator: Simulator, by: float) -> float:
    start = now()
    simulator.AdvanceTo(simulator.get_context().get_time() + by)
    return now() - start


def _warm(scenario: Scenario) -> Simulator:
    """A second after the start, with all compiled: what a tick costs, not what its first time costs."""
    diagram = make_diagram(scenario).diagram
    leaf_of(diagram.GetSubsystemByName("mpc_controller")).mpc.prepare()
    simulator = _started(diagram)
    simulator.AdvanceTo(1.0)
    return simulator


def calls(scenario: Scenario, duration: float) -> dict[str, float]:
    """What a tick calls from Python, and the time of it that is Drake's own arithmetic on the robot (kinematics, …).

    The calls are those that Python's profiler counts: with pybind11 (Drake before 1.52) those into Drake as well.
    """
    ticks = duration / scenario.tick
    simulator, profile = _warm(scenario), Profile()
    profile.runcall(_advanced, simulator, duration)
    with drake_clock() as clock:
        simulator = _warm(scenario)
        clock.clear()
        _advanced(simulator, duration)
    return {
        "python_calls_per_tick": float(sum(entry.callcount for entry in profile.getstats()) / ticks),
        "drake_seconds_per_tick": clock.seconds.get("Drake", 0.0) / ticks,
    }


def blocks(scenario: Scenario, duration: float) -> dict[str, float]:
    """Seconds of a tick by block; "plant and framework" is what is left of the whole."""
    with block_clock() as clock:
        simulator = _warm(scenario)
        clock.clear()
        wall = _advanced(simulator, duration)
        spent = dict(clock.seconds)
    ticks = duration / scenario.tick
    parts = {name: seconds / ticks for name, seconds in sorted(spent.items(), key=lambda item: -item[1])}
    return parts | {"plant and framework": (wall - sum(spent.values())) / ticks}


def plant_steps(steps: list[float], duration: float) -> list[dict[str, Any]]:
    """The walk at several plant steps: does it stay the same walk as at the first one, and how fast is it?"""
    rows: list[dict[str, Any]] = []
    for step in steps:
        scenario = load_scenario("walking", f"{{duration: {duration}, plant: {{time_step: {step}}}}}")
        start = now()
        log = simulate(scenario)
        whole = now() - start
        metrics = compute_metrics(scenario, log, whole, None)
        controller, tick = float("nan"), float("nan")
        if not metrics.fell:
            parts = blocks(scenario, min(duration - 1.0, 3.0))
            controller = sum(parts.values()) - parts["plant and framework"]
            simulator = _warm(scenario)
            tick = _advanced(simulator, duration - 1.0) / round((duration - 1.0) / scenario.tick)
        rows.append(
            {
                "plant_step": step,
                "fell": metrics.fell,
                "mean_speed": metrics.mean_speed,
                "h_min": min((b.h_min for b in metrics.barriers.values() if b.h_min is not None), default=None),
                "zmp_outside_fraction": metrics.zmp_outside_fraction,
                "com_rms_error": metrics.com_rms_error,
                "controller_seconds_per_tick": controller,
                "plant_seconds_per_tick": tick - controller,
                "real_time_factor": scenario.tick / tick,
            }
        )
        rows[-1]["same_walk"] = not metrics.fell and _same(rows[0], rows[-1])
    return rows


def _same(first: dict[str, Any], other: dict[str, Any]) -> bool:
    """The same speed to 5 %; tracking, safety and ZMP not worse than by 5 mm, 5 mm/s and 2 % of the ticks."""
    speed = abs(other["mean_speed"] - first["mean_speed"]) <= _SAME * abs(first["mean_speed"])
    pairs = zip(first["com_rms_error"], other["com_rms_error"], strict=True)
    tracking = all(b is None or b <= a + 0.005 for a, b in pairs)
    zmp = other["zmp_outside_fraction"] <= first["zmp_outside_fraction"] + 0.02
    kept = first["h_min"] is None or other["h_min"] >= first["h_min"] - 0.005
    return bool(speed and tracking and zmp and kept)
