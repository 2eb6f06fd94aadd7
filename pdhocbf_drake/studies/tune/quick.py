"""One gait measured without a simulation."""

from __future__ import annotations

import math

from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.fitting.plan_limits import plan_limits
from pdhocbf_drake.fitting.steady_motion import OutOfReach, steady_motion
from pdhocbf_drake.fitting.step import LARGEST_SHIFT
from pdhocbf_drake.fitting.walk_checks import GOOD_TIME
from pdhocbf_drake.robot import SIDES, Biped, longest_stride
from pdhocbf_drake.simulation.build import nominal_mpc
from pdhocbf_drake.simulation.run_log import FINISHED
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.gait_measures import GaitMeasures, certified_area, peaks_by_role
from pdhocbf_drake.studies.shared.gait_variants import Work
from pdhocbf_drake.walking.com_height import GRAVITY

_REACH = 0.5  # of the longest step that the legs can stand in, as for default steps


def quick_measure(work: Work) -> GaitMeasures:
    """The gait on the template's settled orbit within what joints leave to the plan, without barriers.

    The certified area, which takes longest, is measured where the work names pushes to try.
    """
    scenario = Scenario.model_validate_json(work.scenario)
    gait = scenario.gait
    try:
        biped = Biped.load(scenario.robot)
        longest = longest_stride(biped, gait.stance_width, gait.com_height + gait.com_height_amplitude)
        if abs(gait.stride) > _REACH * longest:
            return GaitMeasures(work.values, f"a stride of {gait.stride:g} m is more than {_REACH * longest:.2g} m")
        growth = math.sqrt(GRAVITY / gait.com_height) * gait.ticks_per_step * gait.tick
        if growth > GOOD_TIME:
            return GaitMeasures(work.values, f"in a step a fall grows by e^{growth:.2f}")
        if scenario.mpc.limits == "model":
            scenario = scenario.model_copy(
                update={"mpc": scenario.mpc.model_copy(update={"limits": plan_limits(biped, gait)})}
            )
        motion = steady_motion(biped, nominal_mpc(scenario, gait.stride, None))
        if isinstance(motion, OutOfReach):
            return GaitMeasures(work.values, motion.reason)
        half = min(float(biped.soles[side].half_size[0]) for side in SIDES)
        share = float(abs(motion.offsets[:, 0]).max()) / half
        if share > LARGEST_SHIFT:
            return GaitMeasures(work.values, f"the swing leg shifts the ZMP by {share:.2f} of the half sole")
        return GaitMeasures(
            work.values,
            FINISHED,
            speed=gait.stride / (gait.ticks_per_step * gait.tick),
            torque=peaks_by_role(motion.torques),
            joint_speed=peaks_by_role(motion.speeds),
            zmp_inside=motion.zmp_inside,
            certified_area=certified_area(scenario) if work.directions else None,
        )
    except PdhocbfError as error:
        return GaitMeasures(work.values, str(error))
