"""The config of a whole run: system, duration, disturbances, and the configs of gait, controller and barriers."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, model_validator

from pdhocbf_drake.config import Config, Name, parse_config, within
from pdhocbf_drake.estimation.config import SensorsConfig
from pdhocbf_drake.ground.config import Piece, in_order
from pdhocbf_drake.ground.terrain import Terrain
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.oscillator.config import VanDerPolConfig
from pdhocbf_drake.simulation.drake_config import completed_plant, completed_simulator
from pdhocbf_drake.walking.barrier_changes import BarrierChange
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig
from pdhocbf_drake.walking.commands import CommandConfig
from pdhocbf_drake.walking.config import GaitConfig, VhipConfig
from pdhocbf_drake.whole_body.config import WholeBodyConfig

DEFAULT_ROBOT = "biped"
System = Literal["biped", "vhip", "van_der_pol"]
_Place = Annotated[float, within(-150.0, 150.0, "m")]
_Force = Annotated[float, within(-1e6, 1e6, "N")]
_Shift = Annotated[float, within(-1.0, 1.0, "m")]
_Ground = tuple[Piece, ...]
_Tilt = Annotated[float, within(-30.0, 30.0, "deg")]


class Push(Config):
    """A constant force on one body for some time.

    Attributes:
        body: the body pushed at its centre of mass; null is the robot's torso.
        time: its start [s]; null where `step` and `phase` give it.
        step: the step in which it starts; 0 is the first one that moves a foot.
        phase: tick of that step [ticks].
        duration: its length [s].
        force: in world axes [N].
    """

    body: str | None = None
    time: float | None = Field(None, ge=0)
    step: int | None = Field(None, ge=0)
    phase: int = Field(0, ge=0)
    duration: float = Field(0.1, gt=0)
    force: tuple[_Force, _Force, _Force]

    @model_validator(mode="after")
    def _one_start(self) -> Push:
        if (self.time is None) == (self.step is None):
            raise ValueError("a push starts either at a time [s] or at a step (with a phase); give exactly one of them")
        return self

    def start(self, gait: GaitConfig) -> float:
        """The start of the push [s]."""
        if self.time is not None:
            return self.time
        return ((gait.start_steps + (self.step or 0)) * gait.ticks_per_step + self.phase) * gait.tick


class ModelErrorConfig(Config):
    """Differences of the simulated robot from the controller's model of it.

    Attributes:
        torso_mass: mass and inertia of the simulated torso over those of the controller's model [1].
        com_shift: of the simulated robot's CoM, ahead, to the left and up, by a shift of the torso's CoM [m].
        gravity_tilt_deg: by which gravity is tilted towards x and y, as on ground that slopes down that way [deg].
    """

    torso_mass: float = Field(1.0, gt=0, le=100)
    com_shift: tuple[_Shift, _Shift, _Shift] = (0.0, 0.0, 0.0)
    gravity_tilt_deg: tuple[_Tilt, _Tilt] = (0.0, 0.0)


class MeasurementNoise(Config):
    """Standard deviations of white noise, drawn anew at every tick, the same in x and y.

    Attributes:
        com: of the CoM [m].
        velocity: of the CoM velocity [m/s].
        zmp: of the ZMP [m].
    """

    com: Annotated[float, within(0.0, 10.0, "m")] = 0.0
    velocity: Annotated[float, within(0.0, 10.0, "m/s")] = 0.0
    zmp: Annotated[float, within(0.0, 10.0, "m")] = 0.0

    @property
    def deviations(self) -> list[float]:
        """One for each element of `lip_state`."""
        return [self.com, self.velocity, self.zmp] * 2


class MeasurementConfig(SensorsConfig):
    """What the controller is given, and with which errors.

    Attributes:
        source: "true_state" is the robot's own state; "sensors" is what the estimator makes of the sensors.
        drives: what the joints' PD reads: "own" are encoders of its own, without error, at every instant; "sampled" are
            those that the estimator reads, once a tick, with gains that a torque held for a tick allows.
        seed: of the sensors' biases, offsets and noise; null takes the scenario's.
        noise: added to the CoM and ZMP.
        delay_ticks: delay of CoM, ZMP and soles, besides that of the sensors [ticks].
    """

    source: Literal["true_state", "sensors"] = "true_state"
    drives: Literal["own", "sampled"] = "own"
    seed: int | None = Field(None, ge=0, lt=2**32)
    noise: MeasurementNoise = MeasurementNoise()
    delay_ticks: int = Field(0, ge=0, le=1000)

    @property
    def late_ticks(self) -> int:
        """How late the controller is given what was measured, the slowest sensor's delay included [ticks]."""
        return self.delay_ticks + self.sensor_delay * (self.source == "sensors")


class BipedConfig(Config):
    """The robot itself.

    Attributes:
        weigh: whether the robot is weighed in a stand of a second before the walk: the controller's model of it, for
            inverse kinematics, torques and the estimator, gets a torso such that weight and CoM are those measured.
        feels_ground: whether the feet stop where they meet the ground early, go on down where they meet it late, and
            take its tilt; null is where there is `ground`.
        learns_torque: whether what the PD adds on average at hip and knee of the leg that stands, as under a load that
            the model lacks, is learned and sent with the feedforward.
    """

    weigh: bool = False
    feels_ground: bool | None = None
    learns_torque: bool = True


class StartConfig(Config):
    """Where a walk starts.

    Attributes:
        position: the middle between the feet, x and y [m].
        yaw: heading, counter-clockwise from x [rad].
    """

    position: tuple[_Place, _Place] = (0.0, 0.0)
    yaw: Annotated[float, within(-1e3, 1e3, "rad")] = 0.0


def _apart(pieces: _Ground) -> _Ground:
    """The pieces as they are; raises `ValueError` where two of them are at one place."""
    in_order(pieces)
    return pieces


class Scenario(Config):
    """One run.

    Attributes:
        name: that of the packaged scenario, of its entry in a file, or the stem of the file.
        description: one sentence for `pdhocbf list`.
        system: "biped" (multibody with contact), "vhip" (template alone, eqs. (22)-(24)) or
            "van_der_pol" (eqs. (15)-(18)).
        duration: simulated time [s].
        seed: seed of all random numbers.
        from_time: start of the steady state, from which barriers are judged, eq. (38) [s].
        robot: a robot that comes with the package, or the path of a robot YAML.
        biped: whether the robot is weighed before it walks, and whether its feet feel the ground.
        ground: pieces of the ground that are not flat, each at its place along x; z = 0 where the walk starts.
        friction: Coulomb coefficient between soles and ground [1].
        friction_belief: that for which the walk is planned: where its motion asks more of the soles about the vertical,
            the torso's yaw gives way; null is `friction` [1].
        whole_body: how the planned motion keeps the limits of joints and soles.
        gait, mpc, vhip, van_der_pol: the configs of those parts; the default CoM height and stance width are those of
            the robot.
        barriers: the barriers to keep, by name; null removes one that a scenario extends.
        barrier_changes: barriers that are kept in another way from a time on.
        start: where the walk starts, and its heading.
        commands: velocity and turn rate, or a stop, each from its time on, in place of `gait.stride`. What the legs,
            soles or programs can't do is granted in part. A barrier's bound follows the orbit of each command, see
            `CommandedBound`.
        path: waypoints to walk along, x and y, in place of `commands`; at the last one the walk comes to a stand [m].
        path_speed: speed along `path` [m/s].
        pushes: forces on the robot, or on the template's mass.
        wind: a steady horizontal force on the torso's centre of mass, or on the template's mass, in x and y [N].
        model_error: differences of the simulated robot from the controller's model of it.
        measurement: noise and delay of the measurements that the controller gets.
        plant, simulator: Drake's `MultibodyPlantConfig` and `SimulatorConfig`. The defaults are Drake's, except that
            contact is solved by SAP on points, never softened for being near rigid.
    """

    name: Name = "scenario"
    description: str = ""
    system: System = "biped"
    duration: Annotated[float, within(0.0, 36000.0, "s", above=True)] = 10.0
    seed: int = Field(0, ge=0, lt=2**32)
    from_time: float = Field(2.0, ge=0)
    robot: str = DEFAULT_ROBOT
    biped: BipedConfig = BipedConfig()
    ground: Annotated[_Ground, AfterValidator(_apart)] = ()
    friction: float = Field(0.8, gt=0, le=10)
    friction_belief: float | None = Field(None, gt=0, le=10)
    whole_body: WholeBodyConfig = WholeBodyConfig()
    gait: GaitConfig = GaitConfig()
    mpc: MpcConfig = MpcConfig()
    barriers: dict[Name, WalkBarrierConfig] = Field({})
    barrier_changes: tuple[BarrierChange, ...] = ()
    start: StartConfig = StartConfig()
    commands: tuple[CommandConfig, ...] = ()
    path: tuple[tuple[_Place, _Place], ...] = ()
    path_speed: Annotated[float, within(0.0, 10.0, "m/s", above=True)] = 0.3
    pushes: tuple[Push, ...] = ()
    wind: tuple[_Force, _Force] = (0.0, 0.0)
    model_error: ModelErrorConfig = ModelErrorConfig()
    measurement: MeasurementConfig = MeasurementConfig()
    vhip: VhipConfig = VhipConfig()
    van_der_pol: VanDerPolConfig = VanDerPolConfig()
    plant: Annotated[dict[str, Any], AfterValidator(completed_plant)] = Field({}, validate_default=True)
    simulator: Annotated[dict[str, Any], AfterValidator(completed_simulator)] = Field({}, validate_default=True)

    @property
    def believed_friction(self) -> float:
        """`friction_belief`, or without one `friction`."""
        return self.friction if self.friction_belief is None else self.friction_belief

    @property
    def terrain(self) -> Terrain:
        """The ground under the walk."""
        return Terrain(self.ground, self.start.position, self.friction)

    @property
    def tick(self) -> float:
        """The sampling interval of the log [s]."""
        return self.van_der_pol.tick if self.system == "van_der_pol" else self.gait.tick

    @classmethod
    def from_dict(cls, data: Any, where: str) -> Scenario:
        """A scenario from plain YAML data; raises `InputError`."""
        barriers = data.get("barriers") if isinstance(data, dict) else None
        if isinstance(barriers, dict):
            data = {**data, "barriers": {name: barrier for name, barrier in barriers.items() if barrier is not None}}
        return parse_config(cls, data, where)

    def to_dict(self) -> dict[str, Any]:
        """Plain data with every default written out, from which `from_dict` makes an equal scenario."""
        return self.model_dump(mode="json")
