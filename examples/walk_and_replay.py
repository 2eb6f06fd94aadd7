"""The biped walks for four seconds under a periodic barrier; a run folder, its replay and its report are written."""

from pathlib import Path

from pdhocbf_drake import load_scenario, replay, report, simulate, write_run

# Any setting of docs/scenario.md can be overridden in YAML.
scenario = load_scenario("walking", "{duration: 4.0, gait: {stride: 0.12}}")
log = simulate(scenario)

folder = Path("runs/example_walk")
run = write_run(folder, log, scenario)
page = replay(run, folder / "replay.html")
report(run, folder / "report.html", replays=[page])

x, vx = log.element("lip_state", "x"), log.element("lip_state", "vx")
steady = log.after(scenario.from_time)
print(f"{log.ending}: walked {x[-1] - x[0]:.2f} m in {log.time[-1]:.1f} s, at up to {vx.max():.2f} m/s")
print(f"barrier: h is at least {steady['h'].min():.3f} m/s from {scenario.from_time:g} s on")
print(f"open {folder / 'replay.html'} in a browser, or see {folder / 'report.html'}")
