"""The sections of a scenario file: keys, units, bounds and defaults."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from lariat.geometry import obstacles as geometry
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.trajectory import MotionLimits
from shared.configuration import Bounds, Extensible

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Meters = Annotated[float, Bounds(1e-4, 100.0, "m")]
Position = Annotated[Vector, Bounds(-20.0, 20.0, "m")]
Color = Annotated[tuple[int, int, int], Bounds(0, 255)]
Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")
"""Both ends of the rope, in the order of grips and arms."""
CONTROL_METHODS = Extensible(("gauss_newton", "network", "actions"), "lariat.controllers")
"""Controllers: `lariat.protocols.Controller`."""
STATE_ESTIMATORS = Extensible(("rod",), "lariat.state_estimators")
"""State estimators: `lariat.protocols.StateEstimator`."""
PATH_PLANNERS = Extensible(("whole_path",), "lariat.path_planners")
"""Planners: `lariat.protocols.PathPlanner`."""
PERCEPTION_METHODS = Extensible(("ridge", "paper"), "lariat.perception")
"""Methods that find the rope in images: `lariat.protocols.RopePerception`."""
DRIVERS = Extensible(("fixed", "ideal", "cr5", "simulated", "ur"), "lariat.drivers")
"""Arm drivers; those from outside are a `lariat.protocols.Arm`."""
OWN_PROTOCOL_DRIVERS = ("fixed", "ideal", "cr5")
"""Drivers whose arms are not described by `ends.*.urdf`."""


@dataclass(frozen=True)
class Rope:
    """Properties of the rope as the controller assumes them."""

    length: Annotated[float, Bounds(0.02, 20.0, "m")]
    """Length of the unstretched rope, with what lies in the grippers (`ends.*.grip_length`)."""
    diameter: Annotated[float, Bounds(5e-4, 0.1, "m")]
    """Diameter of its cross-section."""
    node_count: Annotated[int, Bounds(5, 400)] = 40
    """Number of nodes that represent the rope."""
    linear_density: Annotated[float, Bounds(1e-4, 20.0, "kg/m")] = 0.044
    """Mass per length."""
    youngs_modulus: Annotated[float, Bounds(1e3, 3e11, "Pa")] = 1.0e6
    """Young's modulus E; the bending stiffness is EI = E pi d^4 / 64."""
    poisson_ratio: Annotated[float, Bounds(-0.5, 0.5)] = 0.3
    """Poisson's ratio nu; the twisting stiffness is GJ = EI / (1 + nu)."""
    stretch_stiffness: Annotated[float, Bounds(1.0, 1e8, "N")] = 2000.0
    """Axial force per strain, EA."""
    damping: Annotated[float, Bounds(0.0, 100.0, "1/s")] = 1.0
    """Decay rate of the velocity, as by air drag."""
    internal_damping: Annotated[float, Bounds(0.0, 1.0, "s")] = 0.0
    """Viscous moment per rate of curvature, divided by EI (Kelvin-Voigt); likewise in twist."""

    def __post_init__(self) -> None:
        if self.diameter > 0.25 * self.length:
            raise ValueError(
                f"diameter = {self.diameter} m is more than a quarter of length = {self.length} m; "
                "a rod is slender: check the units"
            )


@dataclass(frozen=True)
class PlantRope:
    """Properties in which the true rope differs from `[rope]`."""

    length: Annotated[float, Bounds(0.02, 20.0, "m")] | None = None
    diameter: Annotated[float, Bounds(5e-4, 0.1, "m")] | None = None
    node_count: Annotated[int, Bounds(5, 1200)] | None = None
    """Number of nodes of the simulated rope; by default every edge of `[rope]` is three edges of
    it."""
    linear_density: Annotated[float, Bounds(1e-4, 20.0, "kg/m")] | None = None
    youngs_modulus: Annotated[float, Bounds(1e3, 3e11, "Pa")] | None = None
    poisson_ratio: Annotated[float, Bounds(-0.5, 0.5)] | None = None
    stretch_stiffness: Annotated[float, Bounds(1.0, 1e8, "N")] | None = None
    damping: Annotated[float, Bounds(0.0, 100.0, "1/s")] | None = None
    internal_damping: Annotated[float, Bounds(0.0, 1.0, "s")] | None = None
    """As in `[rope]`; for the models `rod` and `links`."""
    stiffness_profile: tuple[float, ...] = ()
    """Factors on the bending stiffness at evenly spaced points along the rope, left end first."""
    rest_curvature: Annotated[Vector, Bounds(-200.0, 200.0, "1/m")] = (0.0, 0.0, 0.0)
    """Curvature (two) and twist per length of the unloaded rope, in its material frame."""


@dataclass(frozen=True)
class TrueGrip:
    """Error of a grip: where the rope is truly held, in the frame of the grip that is believed."""

    offset: Annotated[Vector, Bounds(-0.05, 0.05, "m")] = (0.0, 0.0, 0.0)
    """Position at which the rope is held."""
    rotation: Annotated[Vector, Bounds(-45.0, 45.0, "deg")] = (0.0, 0.0, 0.0)
    """Rotation vector of the direction in which it is held."""


@dataclass(frozen=True)
class TrueGrips:
    """Errors of both grips, which the controller does not know."""

    left: TrueGrip = TrueGrip()
    right: TrueGrip = TrueGrip()


@dataclass(frozen=True)
class Slip:
    """Fault of a grip: the rope slips out of it during a run."""

    side: Literal["", "left", "right"] = ""
    """The grip; empty: both hold. For the model `links`."""
    time: Annotated[float, Bounds(0.0, 3600.0, "s")] = 0.0
    """Time since the start of the run."""


@dataclass(frozen=True)
class Plant:
    """Simulation that stands for the real cell."""

    model: Literal["rod", "mujoco", "links"] = "rod"
    """Simulator of the rope: this project's rod, MuJoCo's elastic rod (a flex), or a chain of rigid
    links with springs in its joints, in MuJoCo; the last runs slower than real time."""
    rope: PlantRope = PlantRope()
    grips: TrueGrips = TrueGrips()
    slip: Slip = Slip()
    self_contact: bool = False
    """Whether strands of the model `rod` collide with each other."""
    friction: Annotated[float, Bounds(0.0, 5.0)] = 0.3
    """Friction coefficient between rope and obstacles."""
    color: Color = (255, 255, 255)
    """Colour of the rope: red, green, blue."""
    table_color: Color = (12, 12, 12)
    """Colour of the table and of every other half space."""
    camera_shift: Annotated[Vector, Bounds(-1.0, 1.0, "m")] = (0.0, 0.0, 0.0)
    """Displacement of the true camera from its pose in `[sensing]`."""
    camera_turn: Annotated[Vector, Bounds(-90.0, 90.0, "deg")] = (0.0, 0.0, 0.0)
    """Rotation vector of the true camera from its pose in `[sensing]`, in the world frame."""

    def __post_init__(self) -> None:
        if self.slip.side and self.model != "links":
            raise ValueError(
                f"slip: the rope of model = {self.model!r} cannot leave a grip; use model = 'links'"
            )


@dataclass(frozen=True)
class End:
    """Arm that holds one end of the rope."""

    driver: Annotated[str, DRIVERS] = "ideal"
    """`fixed`: the end does not move; `ideal`: it follows setpoints exactly; `cr5`: a Dobot CR5;
    `simulated`: the arm of `urdf` in MuJoCo; `ur`: a Universal Robots arm; or an own class."""
    rotates: bool = False
    """Whether the gripper may change its orientation; in the paper it does not."""
    arm_automatically: bool = True
    """Whether the gateway arms this end without a person; it never does with an `address`."""
    address: str = ""
    """Address of a real arm; if empty, the arm is emulated or simulated."""
    urdf: str = ""
    """URDF of an arm that brings none: a file in the scenario's folder, or an absolute path."""
    flange: str = ""
    """Link of that URDF that carries the tool."""
    firmware: Literal["v3", "v4"] = "v3"
    """Firmware of the emulated arm; that of a real arm is detected."""
    grip_length: Annotated[float, Bounds(0.0, 0.5, "m")] = 0.0
    """Length of the rope that lies in the gripper's pads and cannot move; the grip is the point
    where the rope leaves them."""
    base_position: Position = (0.0, 0.0, 0.0)
    """Position of the arm's base, the root of its URDF, in the world."""
    base_orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    """Orientation of the arm's base in the world."""
    tool_position: Annotated[Vector, Bounds(-1.0, 1.0, "m")] = (0.0, 0.0, 0.12)
    """Position of the grip in the flange's frame."""
    tool_orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    """Orientation of the grip in the flange's frame."""
    tool_output: Annotated[int, Bounds(1, 2)] = 1
    """Digital output at the flange that closes the gripper."""
    load: Annotated[float, Bounds(0.0, 5.0, "kg")] = 0.0
    """Mass of the gripper and what it holds; a CR5 reports a collision if it is wrong."""
    load_center: Annotated[Vector, Bounds(-0.5, 0.5, "m")] = (0.0, 0.0, 0.0)
    """Centre of that mass in the flange's frame."""
    collision_level: Annotated[int, Bounds(0, 5)] = 3
    """Sensitivity of a CR5's collision detection: 0 is off, 5 is the most sensitive."""
    calibrated: bool = False
    """Whether the emulated arm's kinematics differ from the nominal ones, as a real arm's do."""

    def __post_init__(self) -> None:
        if self.driver == "fixed" and self.rotates:
            raise ValueError("rotates = true needs a driver that moves, got driver = 'fixed'")
        if self.address and self.driver in ("fixed", "ideal", "simulated"):
            raise ValueError(
                f"address = {self.address!r} needs the driver of an arm, not {self.driver!r}"
            )
        if self.driver in ("simulated", "ur") and not (self.urdf and self.flange):
            raise ValueError(f"driver = {self.driver!r} needs urdf and flange")
        if self.urdf and self.driver in OWN_PROTOCOL_DRIVERS:
            raise ValueError(f"urdf = {self.urdf!r} has no meaning for driver = {self.driver!r}")


@dataclass(frozen=True)
class Ends:
    """Arms at both ends of the rope."""

    left: End = End()
    right: End = End()


@dataclass(frozen=True)
class Shape:
    """Shape of the rope, given by two grips with the rope at rest between them, or by its nodes."""

    line: tuple[Position, Position] | None = None
    """Positions of the left and the right grip; the rope hangs at rest between them."""
    nodes: str = ""
    """CSV file in the scenario's folder: x, y, z [m] in each row, left end first."""
    left_orientation: Quaternion | None = None
    """Orientation of the left grip; by default it points along the rope."""
    right_orientation: Quaternion | None = None
    """Orientation of the right grip; by default it points along the rope."""
    turns: Annotated[float, Bounds(-10.0, 10.0)] = 0.0
    """Twist of the right end relative to the left one about the rope's axis, in whole turns."""

    def __post_init__(self) -> None:
        if (self.line is None) == (self.nodes == ""):
            raise ValueError("give either line = [[x, y, z], [x, y, z]] or nodes = 'FILE.csv'")


@dataclass(frozen=True)
class Obstacle:
    """Obstacle that the rope must not touch, or a support that it may lean on."""

    shape: Literal["cylinder", "box", "sphere", "capsule", "half_space"]
    """Shape of the obstacle; cylinder and capsule have their axis along z."""
    position: Position
    """Centre; of a half space, a point on its surface."""
    orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    """Orientation in the world."""
    radius: Annotated[float, Bounds(1e-4, 10.0, "m")] | None = None
    """Radius of a cylinder, capsule or sphere."""
    height: Annotated[float, Bounds(1e-4, 10.0, "m")] | None = None
    """Height of a cylinder; of a capsule, the distance between the centres of its caps."""
    size: Annotated[Vector, Bounds(1e-4, 20.0, "m")] | None = None
    """Edge lengths of a box along x, y, z."""
    normal: Vector = (0.0, 0.0, 1.0)
    """Outward normal of a half space."""
    support: bool = False
    """Whether the rope may lean on it."""
    name: str = ""
    """Name, unique in the scene; by default shape and index."""
    marker: Annotated[int, Bounds(0, 49)] | None = None
    """Id of the ArUco marker (4x4_50) on its upper face, if it has one."""
    marker_size: Annotated[float, Bounds(0.005, 1.0, "m")] = 0.04
    """Edge length of the marker's black square."""
    stands_at: Position | None = None
    """True position in simulation, found by the marker only; by default `position`."""
    stands_turned: Annotated[float, Bounds(-180.0, 180.0, "deg")] = 0.0
    """True rotation about the world's z in simulation, relative to `orientation`."""

    def __post_init__(self) -> None:
        if self.marker is None and (self.stands_at is not None or self.stands_turned != 0.0):
            raise ValueError("stands_at and stands_turned need a marker by which they are found")
        needed = {
            "cylinder": ("radius", "height"),
            "capsule": ("radius", "height"),
            "sphere": ("radius",),
            "box": ("size",),
            "half_space": (),
        }[self.shape]
        for key in needed:
            if getattr(self, key) is None:
                raise ValueError(f"a {self.shape} needs {key}")
        for key in {"radius", "height", "size"} - set(needed):
            if getattr(self, key) is not None:
                raise ValueError(f"a {self.shape} has no {key}; remove it")
        if np.linalg.norm(self.normal) < 1e-9 or np.linalg.norm(self.orientation) < 1e-9:
            raise ValueError("normal and orientation must not be zero")

    def body(self, index: int) -> geometry.Obstacle:
        """Return the obstacle as a geometric body.

        Args:
            index: Index in the file, for the name of an obstacle without one.
        """
        return geometry.Obstacle(
            shape=self.shape,
            position=self.position,
            orientation=tuple(poses.normalized(np.array(self.orientation)).tolist()),
            radius=self.radius or 0.0,
            height=self.height or 0.0,
            size=self.size or (0.0, 0.0, 0.0),
            normal=self.normal,
            support=self.support,
            name=self.name or f"{self.shape}-{index}",
        )


@dataclass(frozen=True)
class FlangeMarker:
    """ArUco marker that moves with a grip, by which the camera's pose is calibrated."""

    marker: Annotated[int, Bounds(0, 49)]
    """Id of the marker (4x4_50)."""
    side: Side = "right"
    """Grip that carries it."""
    size: Annotated[float, Bounds(0.005, 1.0, "m")] = 0.04
    """Edge length of its black square."""
    position: Annotated[Vector, Bounds(-1.0, 1.0, "m")] = (0.0, 0.03, 0.04)
    """Position of its centre in the grip's frame."""
    orientation: Quaternion = (0.5, -0.5, -0.5, -0.5)
    """Orientation of its frame (x right, y up, z out of its face) in the grip's frame; by default
    it faces along the grip's y, which is up if the grip is level."""

    def at(self, grip: Pose) -> Pose:
        """Return the marker's pose in the world for a pose of its grip."""
        return Pose(
            grip.apply(np.array(self.position)),
            poses.multiply(grip.orientation, poses.normalized(np.array(self.orientation))),
        )


def check_resolution(resolution: tuple[int, int]) -> None:
    """Check the size of images [pixels].

    Raises:
        ValueError: They are too small or too large.
    """
    if not all(64 <= count <= 4096 for count in resolution):
        raise ValueError(f"resolution = {list(resolution)} must lie in 64…4096 pixels")


@dataclass(frozen=True)
class Sensing:
    """Perception of the rope, and its camera."""

    source: Literal["truth", "camera"] = "truth"
    """Source of the rope's nodes: the simulation itself, or images with depth."""
    method: Annotated[str, PERCEPTION_METHODS] = "ridge"
    """Method that finds the rope in images: this project's, the paper's or an own class."""
    resolution: tuple[int, int] = (640, 480)
    """Width and height of the images in pixels."""
    field_of_view: Annotated[float, Bounds(10.0, 120.0, "deg")] = 65.0
    """Horizontal field of view."""
    position: Position = (0.0, -0.05, 1.0)
    """Position of the camera in the world."""
    look_at: Position = (0.0, 0.0, 0.15)
    """Point at which the camera looks."""
    orientation: Quaternion | None = None
    """Orientation of the optical frame (x right, y down, z forward) in the world, as found by
    `lariat calibrate`; it replaces `look_at`."""
    flange_marker: FlangeMarker | None = None
    rate: Annotated[float, Bounds(1.0, 120.0, "Hz")] = 30.0
    """Frame rate."""
    latency: Annotated[float, Bounds(0.0, 1.0, "s")] = 0.02
    """Time from exposure to the publication of an image."""
    node_noise: Annotated[float, Bounds(0.0, 0.1, "m")] = 0.0
    """Standard deviation of the noise on each coordinate of a node, if `source` is `truth`."""
    depth_noise: Annotated[float, Bounds(0.0, 0.05, "m")] = 0.0015
    """Standard deviation of the noise on each pixel's depth in simulation."""
    depth_bias: Annotated[float, Bounds(-0.05, 0.05, "m")] = 0.0
    """Constant error of the depth in simulation."""
    depth_quantum: Annotated[float, Bounds(1e-5, 0.01, "m")] = 0.001
    """Quantisation step of the depth in simulation."""
    edge_dropout: Annotated[float, Bounds(0.0, 1.0)] = 0.5
    """Fraction of the pixels at depth edges without a measurement, in simulation."""
    threshold: Annotated[int, Bounds(1, 254)] = 128
    """Brightness, or likeness to `rope_color`, above which a pixel belongs to the rope."""
    rope_color: Color | None = None
    """Red, green, blue of the fully lit rope, 0…255; by default the rope is found by its
    brightness."""
    outside: bool = False
    """Whether a camera process publishes the images instead of the simulation."""

    def __post_init__(self) -> None:
        check_resolution(self.resolution)


@dataclass(frozen=True)
class PaperControl:
    """Parameters of the paper: its rod (Table 1, `solver = "xpbd"`) and the settings of its MPC."""

    mass: Annotated[float, Bounds(1e-4, 100.0, "kg")] = 0.5
    """Mass m of each node; with the rope's mass divided among the nodes, the rod shrinks instead of
    bending."""
    inertia: Annotated[float, Bounds(1e-6, 10.0, "kg m^2")] = 0.05
    """Moment of inertia I of each edge."""
    linear_damping: Annotated[float, Bounds(0.0, 0.999)] = 0.1
    """Share xi_v of the velocity that is lost per second."""
    angular_damping: Annotated[float, Bounds(0.0, 0.999)] = 0.3
    """Share xi_omega of the angular velocity that is lost per second."""
    bending_compliance: Annotated[float, Bounds(0.0, 10.0, "m^2/N")] = 0.003
    """Compliance beta_b of each inner node: EI = l / (4 beta_b) for nodes at distance l."""
    iterations: Annotated[int, Bounds(1, 1000)] = 20
    """Solver iterations J of Algorithm 1; the paper does not give it."""
    learning_rate: Annotated[float, Bounds(1e-6, 1.0)] = 1e-3
    """Learning rate of Adam on the network's weights; the paper does not give it."""
    optimizer_steps: Annotated[int, Bounds(1, 1000)] = 30
    """Optimiser steps I of Algorithm 2."""
    horizon: Annotated[int, Bounds(1, 100)] = 5
    """Horizon H in steps of `time_step`."""
    time_step: Annotated[float, Bounds(1e-3, 0.1, "s")] = 0.01
    """Time step of the prediction."""
    error_weight: float = 1.0
    """Weight omega_1 of the sum of node distances [1/m]; of their mean, it would be too weak."""
    obstacle_weight: float = 0.01
    """Weight omega_2 of the obstacle term [m^2]."""
    speed_weight: float = 0.5
    """Weight omega_3 of the squared speed [s^2/m^2]."""
    obstacle_distance: Annotated[float, Bounds(1e-3, 1.0, "m")] = 0.03
    """Distance epsilon_d of eq. (13); the paper does not give it. Goals closer to an obstacle are
    not reached exactly."""


@dataclass(frozen=True)
class Control:
    """Model predictive control of the rope."""

    method: Annotated[str, CONTROL_METHODS] = "gauss_newton"
    """Controller: Gauss-Newton, the paper's over a network's weights or over the actions, or an own
    class."""
    state_estimator: Annotated[str, STATE_ESTIMATORS] = "rod"
    """Estimator of the rope's state: this project's with the rod, or an own class."""
    path_planner: Annotated[str, PATH_PLANNERS] = "whole_path"
    """Planner of whole paths: this project's or an own class."""
    solver: Literal["direct", "xpbd"] = "direct"
    """Solver of the predicting rod. `xpbd` is the paper's rod with `[control.paper]`, for the
    methods `network` and `actions`."""
    planner: bool = True
    """Whether a planned path guides the controller."""
    adapt: bool = False
    """Whether the rope's material is estimated during the run; with `xpbd` by the paper's gradient
    descent (15) on five parameters."""
    clearance: Annotated[float, Bounds(0.0, 0.2, "m")] = 0.012
    """Desired distance between the rope's surface and each obstacle that is not a support."""
    horizon: Annotated[int, Bounds(1, 100)] = 5
    """Horizon in steps of `time_step`, for `gauss_newton`."""
    time_step: Annotated[float, Bounds(1e-3, 0.2, "s")] = 0.05
    """Time step of the prediction, for `gauss_newton`."""
    iterations: Annotated[int, Bounds(1, 50)] = 1
    """Gauss-Newton iterations per horizon, each started from the previous solution."""
    speed_weight: Annotated[float, Bounds(0.0, 100.0, "s^2")] = 0.02
    """Weight of the squared velocity that `gauss_newton` adds to the path's, relative to the mean
    squared node distance."""
    acceleration_weight: Annotated[float, Bounds(0.0, 100.0, "s^4")] = 2e-4
    """Weight of the squared rate of change of that velocity."""
    paper: PaperControl = PaperControl()


@dataclass(frozen=True)
class Limits(MotionLimits):
    """Limits of the grippers' motion, which the gateway enforces."""

    speed: Annotated[float, Bounds(0.001, 2.0, "m/s")] = 0.5
    acceleration: Annotated[float, Bounds(0.01, 20.0, "m/s^2")] = 2.0
    jerk: Annotated[float, Bounds(0.1, 1000.0, "m/s^3")] = 40.0
    angular_speed: Annotated[float, Bounds(0.01, 6.0, "rad/s")] = 1.5
    angular_acceleration: Annotated[float, Bounds(0.1, 60.0, "rad/s^2")] = 6.0
    angular_jerk: Annotated[float, Bounds(1.0, 3000.0, "rad/s^3")] = 120.0
    joint_speed: Annotated[float, Bounds(0.01, 3.2, "rad/s")] = 1.6
    joint_acceleration: Annotated[float, Bounds(0.1, 30.0, "rad/s^2")] = 5.2
    workspace: tuple[Position, Position] = ((-0.8, -0.8, 0.01), (0.8, 0.8, 1.2))
    """Lowest and highest corner of the box in which the grips stay."""
    keep_out: Annotated[float, Bounds(0.0, 0.5, "m")] = 0.005
    """Least distance between a gripper's body and an obstacle."""
    gripper_radius: Annotated[float, Bounds(0.001, 0.2, "m")] = 0.012
    """Radius of the capsule that represents a gripper."""
    gripper_height: Annotated[float, Bounds(0.0, 0.5, "m")] = 0.06
    """Distance from the grip to the far end of that capsule."""
    spacing: Annotated[float, Bounds(0.0, 1.0, "m")] = 0.03
    """Least distance between the two grips."""
    overstretch: Annotated[float, Bounds(0.1, 1.0)] = 0.99
    """Largest distance between the grips, measured around obstacles, as a fraction of the rope's
    length."""
    pull: Annotated[float, Bounds(0.1, 200.0, "N")] = 20.0
    """Largest change of the contact force at a gripper since arming, if its arm measures forces."""

    @property
    def gripper_reach(self) -> float:
        """Distance from the grip to the centre of that capsule's far cap [m]."""
        return max(self.gripper_height - self.gripper_radius, 0.0)

    def __post_init__(self) -> None:
        low, high = np.array(self.workspace)
        if np.any(low >= high):
            raise ValueError(
                f"workspace = {[list(c) for c in self.workspace]}; give the low corner first"
            )


@dataclass(frozen=True)
class Run:
    """End of a run."""

    time_limit: Annotated[float, Bounds(0.1, 3600.0, "s")] = 10.0
    """Duration after which a run ends."""
    tolerance: Annotated[float, Bounds(1e-6, 0.5, "m")] = 0.003
    """Mean node distance to the goal below which it counts as reached."""


@dataclass(frozen=True)
class Recording:
    """Files of the recorder: one for each run, and thin ones of the idle cell between runs."""

    pre_roll: Annotated[float, Bounds(0.0, 30.0, "s")] = 3.0
    """Time before a run that its file holds."""
    start_up: Annotated[float, Bounds(0.0, 3600.0, "s")] = 30.0
    """Time after the recorder's start that is recorded whole; a run that begins within it can be
    replayed from the start of every process."""
    longest_file: Annotated[float, Bounds(1.0, 86400.0, "s")] = 3600.0
    """Time after which the next file begins."""
    largest_file: Annotated[float, Bounds(0.001, 1000.0, "GB")] = 1.0
    """Size after which the next file begins."""
    keep: Annotated[float, Bounds(0.01, 1e6, "GB")] = 20.0
    """Size of all recordings in the folder, beyond which the oldest are deleted, those of the idle
    cell first."""


@dataclass(frozen=True)
class Event:
    """Change of the scene or the goal at a given time of a run."""

    time: Annotated[float, Bounds(0.0, 3600.0, "s")]
    """Time since the start of the run."""
    add_obstacle: Obstacle | None = None
    """Obstacle that appears."""
    move_obstacle: str = ""
    """Name of the obstacle that moves to `position`."""
    remove_obstacle: str = ""
    """Name of the obstacle that disappears."""
    position: Position | None = None
    """New position of `move_obstacle`."""
    goal: Shape | None = None
    """New goal."""

    def __post_init__(self) -> None:
        actions = [self.add_obstacle, self.move_obstacle, self.remove_obstacle, self.goal]
        if sum(bool(a) for a in actions) != 1:
            raise ValueError(
                "give exactly one of add_obstacle, move_obstacle, remove_obstacle and goal"
            )
        if bool(self.move_obstacle) != (self.position is not None):
            raise ValueError("give move_obstacle and position together")
