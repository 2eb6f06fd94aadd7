"""The largest push to the left that the walking robot survives at two moments of its gait, found by bisection."""

from pdhocbf_drake import load_scenario, push

scenario = load_scenario("walking", "gait: {stride: 0.1}")
# Tick 0 is the first tick of a step on the right foot; a barrier on the forward speed changes nothing sideways.
impulses = push(
    scenario,
    directions=["+y"],
    phases=[0, 40],
    barriers=["none"],
    tolerance=2.0,
    out="runs/example_push",
)
for impulse in impulses:
    print(f"{impulse.direction} from tick {impulse.phase} of the gait on: {impulse.survived:g} N s are survived")
print("two figures are in runs/example_push")
