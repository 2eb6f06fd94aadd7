"""A campaign: 12 walks of the template, pushed at random, with and without a barrier, on all cores."""

from pathlib import Path

from pdhocbf_drake import campaign

CAMPAIGN = """
description: Pushes from any side in the fifth step, under no barrier and under a periodic one.
scenario: vhip
seed: 1
runs: 12
overrides: {duration: 5.2, pushes: [{step: 4, duration: 0.1, force: [0.0, 0.0, 0.0]}]}
barriers:
  none: {barriers: {forward_speed: null}}
  P-DHOCBF: {}
factors:
  pushes.0.force.0: {low: -140.0, high: 140.0, unit: N}
  pushes.0.force.1: {low: -70.0, high: 70.0, unit: N}
"""


def main():
    file = Path("runs/example_pushes.yaml")
    file.parent.mkdir(exist_ok=True)
    file.write_text(CAMPAIGN, encoding="utf-8")
    result = campaign(file, progress=lambda done, total, words: print(f"{done} of {total} runs {words}"))
    for barrier, rate in result.summary["survival"].items():
        interval = f"95 % interval {100 * rate['low']:.0f} to {100 * rate['high']:.0f} %"
        print(f"{barrier}: {100 * rate['rate']:.0f} % of {rate['n']} pushes survived, {interval}")
    print(f"survival maps are in {result.folder / 'report.html'}, all numbers in {result.folder / 'runs.parquet'}")


if __name__ == "__main__":  # the workers are processes that import this file
    main()
