"""The robot is weighed: its mass and the place of its CoM from a stand, for the controller's model of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.primitives import ConstantVectorSource

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot import Biped, InverseDynamics
from pdhocbf_drake.simulation.biped_plant import add_robot, connect_joints, initial_posture, model_instance
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.simulation.disturbance import add_model_error
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.wiring import Wiring
from pdhocbf_drake.systems.joint_targets import joint_targets

_SETTLED, _READ, _EVERY = 0.6, 0.4, 0.01  # [s]: how long it stands, for how long it is read, and how often
_STANDS = 0.4  # share of the weight that the ground must carry
_LIGHTEST = 0.05  # of the torso, over that of the model


class Stand(NamedTuple):
    """What a stand measures: the ground's load [N], the ZMP (2,) [m], and the positions q (19,)."""

    load: float
    zmp: np.ndarray
    q: np.ndarray


def stand(scenario: Scenario, walk: Walk, biped: Biped) -> Stand:
    """A stand of the simulated robot in the posture from which it walks, on level ground; raises `InputError`.

    The joints hold that posture by their own PD and the torques of the model as it is. A stand in wind or on a slope
    would take these for a shifted CoM, which they are only for as long as they last.
    """
    error = scenario.model_error.model_copy(update={"gravity_tilt_deg": (0.0, 0.0)})
    scenario = scenario.model_copy(update={"model_error": error})
    wiring, posture = Wiring(scenario.tick), initial_posture(walk, biped)
    plant = add_robot(wiring.builder, scenario, biped, posture)
    add_model_error(wiring, scenario.model_error, plant, biped)
    still = np.zeros(biped.plant.num_velocities())
    torque = InverseDynamics(biped)(posture, still, still, 0.5).tau
    targets = wiring.add("joint_targets", joint_targets(biped, posture[biped.q_index], plant.time_step()))
    for port, held in (("desired_state", [*posture[biped.q_index], *np.zeros(12)]), ("feedforward", torque)):
        source = wiring.builder.AddSystem(ConstantVectorSource(np.array(held)))
        wiring.builder.Connect(source.get_output_port(), targets.GetInputPort(port))
    connect_joints(wiring.builder, plant, biped, targets)
    simulator = Simulator(wiring.builder.Build())
    for adjust in wiring.adjust:
        adjust(simulator.get_mutable_context())
    context = plant.GetMyContextFromRoot(simulator.get_context())
    contact = plant.get_generalized_contact_forces_output_port(model_instance(plant, biped))
    origin, samples = biped.base_q_index[4:], []
    for time in np.arange(_SETTLED, _SETTLED + _READ, _EVERY):
        try:
            simulator.AdvanceTo(time)
        except RuntimeError as error:  # Drake's plant raises where its state is not finite
            raise InputError(f"biped.weigh: the stand can't be simulated: {str(error).splitlines()[0]}") from None
        q = plant.GetPositions(context)
        mx, my, _, fx, fy, fz = contact.Eval(context)[biped.base_v_index].tolist()
        x, y, z = q[origin].tolist()
        samples.append([fz, fz * x - my - z * fx, fz * y + mx - z * fy, *q])
    load, along_x, along_y, *q = np.mean(samples, axis=0).tolist()
    place = np.array([along_x, along_y]) / load if load > 0.0 else np.full(2, np.nan)
    return Stand(load, place, biped.clipped(np.array(q)))


def weighed(biped: Biped, stand: Stand) -> Biped:
    """The robot with a torso such that weight and CoM are those of a stand at rest, where the ZMP is below the CoM.

    The torso takes all of the difference: mass m' = m + Δm, and its CoM ahead and aside such that

        M' zmp = M c(q) − m r + m' r'

    with M and c of the whole model and r of its torso. How high the CoM is a stand doesn't say: r'_z = r_z.

    Raises:
        InputError: the robot does not stand, or weighs less than the model's legs.
    """
    gravity, context = biped.weight / biped.mass, biped.context()
    torso, q = biped.torso_frame.body(), stand.q
    known = torso.CalcSpatialInertiaInBodyFrame(context)
    own, centre = known.get_mass(), known.get_com()
    mass = own + stand.load / gravity - biped.mass
    if not np.all(np.isfinite([stand.load, *stand.zmp, *q])) or stand.load < _STANDS * biped.weight:
        raise InputError(
            f"biped.weigh: the robot does not stand, the ground carries {stand.load:.3g} N of {biped.weight:.3g}"
        )
    if mass < _LIGHTEST * own:
        raise InputError(
            f"biped.weigh: the robot weighs {stand.load / gravity:.3g} kg, which leaves its torso {mass:.3g} kg of "
            f"{own:.3g}"
        )
    biped.plant.SetPositions(context, q)
    pose = torso.EvalPoseInWorld(context)
    whole, place = biped.plant.CalcCenterOfMassPositionInWorld(context), pose @ centre
    shifted = place.copy()
    shifted[:2] = (stand.load / gravity * stand.zmp - biped.mass * whole[:2] + own * place[:2]) / mass
    about_com = known.Shift(centre).CalcRotationalInertia() * (mass / own)
    return biped.with_torso(SpatialInertia.MakeFromCentralInertia(mass, pose.inverse() @ shifted, about_com))
