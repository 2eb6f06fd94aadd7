"""Can a walk be kept under its velocity bound for ever? The certified sets of three bounds on the template."""

from pdhocbf_drake import certify, load_scenario

bounds = {
    "periodic, 7.3 mm/s above the walk": "{kind: orbit, margin: 0.0073}",
    "constant, 7.3 mm/s above its peak": "{kind: orbit_peak, margin: 0.0073}",
    "constant, below the mean velocity": "{kind: constant, value: 0.3}",
}
for number, (name, bound) in enumerate(bounds.items(), start=1):
    # A few ticks a step and steps that may not change keep this example short.
    text = f"""
        gait: {{ticks_per_step: 20, double_support_ticks: 4, tick: 0.02}}
        mpc: {{horizon: 40, freeze_ticks: 4, step_tolerance: [0.0, 0.0]}}
        barriers: {{forward_speed: {{bound: {bound}}}}}
    """
    found = certify(load_scenario("vhip", text), rows=False, out=f"runs/example_certify_{number}")
    if not found["enforceable"]:
        print(f"{name}: can't be kept, no state is left at phase {found['first_failing_phase']}")
        continue
    weakest = min(found["phases"], key=lambda phase: phase["push_max"])
    print(f"{name}: can be kept from {100 * found['area_share']:.0f} % of the states that can walk on without it;")
    print(f"    a push forward of {weakest['push_max']:.1f} N s leaves it possible at the weakest phase")
print("safe tubes and sections are drawn in runs/example_certify_*/figures")
