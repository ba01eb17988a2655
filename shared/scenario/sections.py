"""The sections of a scenario file: keys, units, bounds and defaults."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from lariat.geometry import obstacles as geometry
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.trajectory import MotionLimits
from shared.configuration import Bounds

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Meters = Annotated[float, Bounds(1e-4, 100.0, "m")]
Place = Annotated[Vector, Bounds(-20.0, 20.0, "m")]
Color = Annotated[tuple[int, int, int], Bounds(0, 255)]
Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True)
class Rope:
    """What the controller believes of the rope."""

    length: Annotated[float, Bounds(0.02, 20.0, "m")]
    diameter: Annotated[float, Bounds(5e-4, 0.1, "m")]
    node_count: Annotated[int, Bounds(5, 400)] = 40
    linear_density: Annotated[float, Bounds(1e-4, 20.0, "kg/m")] = 0.044
    youngs_modulus: Annotated[float, Bounds(1e3, 3e11, "Pa")] = 1.0e6
    """Bending stiffness EI = E pi d^4 / 64."""
    poisson_ratio: Annotated[float, Bounds(-0.5, 0.5)] = 0.3
    stretch_stiffness: Annotated[float, Bounds(1.0, 1e8, "N")] = 2000.0
    damping: Annotated[float, Bounds(0.0, 100.0, "1/s")] = 1.0
    """Velocity lost to the surroundings."""
    internal_damping: Annotated[float, Bounds(0.0, 1.0, "s")] = 0.0
    """Time over which the material itself resists bending and twisting (Kelvin-Voigt)."""

    def __post_init__(self) -> None:
        if self.diameter > 0.25 * self.length:
            raise ValueError(
                f"diameter = {self.diameter} m is more than a quarter of length = {self.length} m; "
                "a rod is slender: check the units"
            )


@dataclass(frozen=True)
class PlantRope:
    """Where the true rope differs from what the controller believes."""

    length: Annotated[float, Bounds(0.02, 20.0, "m")] | None = None
    diameter: Annotated[float, Bounds(5e-4, 0.1, "m")] | None = None
    node_count: Annotated[int, Bounds(5, 400)] | None = None
    linear_density: Annotated[float, Bounds(1e-4, 20.0, "kg/m")] | None = None
    youngs_modulus: Annotated[float, Bounds(1e3, 3e11, "Pa")] | None = None
    poisson_ratio: Annotated[float, Bounds(-0.5, 0.5)] | None = None
    stretch_stiffness: Annotated[float, Bounds(1.0, 1e8, "N")] | None = None
    damping: Annotated[float, Bounds(0.0, 100.0, "1/s")] | None = None
    internal_damping: Annotated[float, Bounds(0.0, 1.0, "s")] | None = None
    """Of the rod model."""
    stiffness_profile: tuple[float, ...] = ()
    """Factors on the bending stiffness along the rope, from left to right, evenly spread."""
    rest_curvature: Annotated[Vector, Bounds(-200.0, 200.0, "1/m")] = (0.0, 0.0, 0.0)
    """Curvature (two) and twist per length of the unloaded rope, material frame."""


@dataclass(frozen=True)
class Plant:
    """What plays the real rope."""

    model: Literal["rod", "mujoco"] = "rod"
    rope: PlantRope = PlantRope()
    self_contact: bool = False
    """Whether strands of the rod model touch each other instead of passing through."""
    friction: Annotated[float, Bounds(0.0, 5.0)] = 0.3
    color: Color = (255, 255, 255)
    """Of the rope."""
    table_color: Color = (12, 12, 12)
    """Of the table and of every other half space."""
    camera_shift: Annotated[Vector, Bounds(-1.0, 1.0, "m")] = (0.0, 0.0, 0.0)
    """Of the true camera from where `sensing` has it."""
    camera_turn: Annotated[Vector, Bounds(-90.0, 90.0, "deg")] = (0.0, 0.0, 0.0)
    """Rotation vector of the true camera from what `sensing` has, in the world."""


@dataclass(frozen=True)
class End:
    """One end of the rope and what holds it."""

    driver: Literal["fixed", "ideal", "cr5"] = "ideal"
    rotates: bool = False
    """False: the gripper keeps its orientation, as in the paper."""
    arm_automatically: bool = True
    """Whether the gateway may arm this end without a person; never with an `address`."""
    address: str = ""
    """Host of a real CR5; empty: the emulator plays it."""
    firmware: Literal["v3", "v4"] = "v3"
    """Of the emulator; a real arm's version is detected."""
    base_position: Place = (0.0, 0.0, 0.0)
    """Of the CR5's base in the world."""
    base_orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    tool_position: Annotated[Vector, Bounds(-1.0, 1.0, "m")] = (0.0, 0.0, 0.12)
    """Of the grip in the flange's frame."""
    tool_orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    tool_output: Annotated[int, Bounds(1, 2)] = 1
    """Output at the flange that closes the gripper."""
    load: Annotated[float, Bounds(0.0, 5.0, "kg")] = 0.0
    """Of the gripper and what it holds, which a CR5 is told: it takes a wrong load for a push."""
    load_center: Annotated[Vector, Bounds(-0.5, 0.5, "m")] = (0.0, 0.0, 0.0)
    """Centre of that mass in the flange's frame."""
    collision_level: Annotated[int, Bounds(0, 5)] = 3
    """How soon a CR5 takes a push for a collision: 0 never, 5 soonest."""
    calibrated: bool = False
    """The emulator's geometry differs from the nominal one, as a real arm's does."""

    def __post_init__(self) -> None:
        if self.driver == "fixed" and self.rotates:
            raise ValueError("rotates = true needs a driver that moves, got driver = 'fixed'")
        if self.address and self.driver != "cr5":
            raise ValueError(f"address = {self.address!r} needs driver = 'cr5', not {self.driver}")


@dataclass(frozen=True)
class Ends:
    left: End = End()
    right: End = End()


@dataclass(frozen=True)
class Shape:
    """Where the rope is or shall be: two grips with the rope at rest between them, or its nodes."""

    line: tuple[Place, Place] | None = None
    """The two grips; the rope between them hangs at rest."""
    nodes: str = ""
    """A CSV file beside the scenario: x, y, z [m] in each row, from the left end to the right."""
    left_orientation: Quaternion | None = None
    """Of the left grip, wxyz; without it the grip points along the rope."""
    right_orientation: Quaternion | None = None
    turns: Annotated[float, Bounds(-10.0, 10.0)] = 0.0
    """Whole turns of twist of the right end against the left one, about the rope's axis."""

    def __post_init__(self) -> None:
        if (self.line is None) == (self.nodes == ""):
            raise ValueError("give either line = [[x, y, z], [x, y, z]] or nodes = 'FILE.csv'")


@dataclass(frozen=True)
class Obstacle:
    """One body that the rope must not touch, or may lean on."""

    shape: Literal["cylinder", "box", "sphere", "capsule", "half_space"]
    position: Place
    orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    radius: Annotated[float, Bounds(1e-4, 10.0, "m")] | None = None
    height: Annotated[float, Bounds(1e-4, 10.0, "m")] | None = None
    size: Annotated[Vector, Bounds(1e-4, 20.0, "m")] | None = None
    normal: Vector = (0.0, 0.0, 1.0)
    support: bool = False
    name: str = ""
    marker: Annotated[int, Bounds(0, 49)] | None = None
    """Id of the ArUco marker (4x4_50) on its upper face, when it carries one."""
    marker_size: Annotated[float, Bounds(0.005, 1.0, "m")] = 0.04
    """Side of the marker's black square."""
    stands_at: Place | None = None
    """Where it really stands, which only its marker tells; in the simulated lab."""
    stands_turned: Annotated[float, Bounds(-180.0, 180.0, "deg")] = 0.0
    """How far it is really turned about the world's z, as `stands_at`."""

    def __post_init__(self) -> None:
        if self.marker is None and (self.stands_at is not None or self.stands_turned != 0.0):
            raise ValueError("stands_at and stands_turned need a marker, which tells them")
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
        """The same for geometry; unnamed ones are called by their place in the file."""
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
    """An ArUco marker that moves with a grip, by which the camera's place is calibrated."""

    marker: Annotated[int, Bounds(0, 49)]
    """Its id (4x4_50)."""
    side: Side = "right"
    """Which grip carries it."""
    size: Annotated[float, Bounds(0.005, 1.0, "m")] = 0.04
    """Side of its black square."""
    position: Annotated[Vector, Bounds(-1.0, 1.0, "m")] = (0.0, 0.03, 0.04)
    """Of its middle in the grip's frame."""
    orientation: Quaternion = (0.5, -0.5, -0.5, -0.5)
    """Of its frame (x right, y up, z out of its face) in the grip's; by default it faces the
    grip's y, which is up where a grip is level."""

    def at(self, grip: Pose) -> Pose:
        """Where it is when its grip is there."""
        return Pose(
            grip.apply(np.array(self.position)),
            poses.multiply(grip.orientation, poses.normalized(np.array(self.orientation))),
        )


@dataclass(frozen=True)
class Sensing:
    """How the rope is seen."""

    source: Literal["truth", "camera"] = "truth"
    method: Literal["ridge", "paper"] = "ridge"
    resolution: tuple[int, int] = (640, 480)
    field_of_view: Annotated[float, Bounds(10.0, 120.0, "deg")] = 65.0
    """Horizontal."""
    position: Place = (0.0, -0.05, 1.0)
    """Of the camera in the world."""
    look_at: Place = (0.0, 0.0, 0.15)
    orientation: Quaternion | None = None
    """Of the optical frame (x right, y down, z forward) in the world, in the place of `look_at`:
    what `lariat calibrate` finds."""
    flange_marker: FlangeMarker | None = None
    rate: Annotated[float, Bounds(1.0, 120.0, "Hz")] = 30.0
    latency: Annotated[float, Bounds(0.0, 1.0, "s")] = 0.02
    """From exposure to image."""
    node_noise: Annotated[float, Bounds(0.0, 0.1, "m")] = 0.0
    """Standard deviation of every coordinate of a seen node, where the truth is sensed."""
    depth_noise: Annotated[float, Bounds(0.0, 0.05, "m")] = 0.0015
    """Standard deviation of a pixel."""
    depth_bias: Annotated[float, Bounds(-0.05, 0.05, "m")] = 0.0
    depth_quantum: Annotated[float, Bounds(1e-5, 0.01, "m")] = 0.001
    edge_dropout: Annotated[float, Bounds(0.0, 1.0)] = 0.5
    """Fraction of pixels at depth edges that see nothing."""
    threshold: Annotated[int, Bounds(1, 254)] = 128
    """Brightness, or likeness to `rope_color`, from which a pixel belongs to the rope."""
    rope_color: Color | None = None
    """Red, green, blue of the rope in full light, 0…255: then its colour tells it from the
    background; without it, that it is the brightest thing in view."""
    outside: bool = False
    """A camera process of the user publishes; the simulated one stays silent."""

    def __post_init__(self) -> None:
        for count in self.resolution:
            if not 64 <= count <= 4096:
                raise ValueError(f"resolution = {list(self.resolution)} must lie in 64…4096 pixels")


@dataclass(frozen=True)
class PaperControl:
    """The paper's own parameters: its rod (Table 1, `solver = "xpbd"`) and its MPC's settings."""

    mass: Annotated[float, Bounds(1e-4, 100.0, "kg")] = 0.5
    """m, per node: with the total spread over the nodes the rod shrinks instead of bending."""
    inertia: Annotated[float, Bounds(1e-6, 10.0, "kg m^2")] = 0.05
    """I, of every edge."""
    linear_damping: Annotated[float, Bounds(0.0, 0.999)] = 0.1
    """xi_v, lost per second."""
    angular_damping: Annotated[float, Bounds(0.0, 0.999)] = 0.3
    """xi_omega."""
    bending_compliance: Annotated[float, Bounds(0.0, 10.0, "m^2/N")] = 0.003
    """beta_b, of every inner node: EI = l / (4 beta_b) between nodes l apart."""
    iterations: Annotated[int, Bounds(1, 1000)] = 20
    """J of Algorithm 1, not given in the paper."""
    learning_rate: Annotated[float, Bounds(1e-6, 1.0)] = 1e-3
    """Of Adam on the network's weights, not given in the paper."""
    optimizer_steps: Annotated[int, Bounds(1, 1000)] = 30
    """I of Algorithm 2."""
    horizon: Annotated[int, Bounds(1, 100)] = 5
    """H, steps of `time_step`."""
    time_step: Annotated[float, Bounds(1e-3, 0.1, "s")] = 0.01
    error_weight: float = 1.0
    """omega_1 [1/m], on the sum of node distances: with their mean omega_3 holds the rope back."""
    obstacle_weight: float = 0.01
    """omega_2 [m^2]."""
    speed_weight: float = 0.5
    """omega_3 [s^2/m^2]."""
    obstacle_distance: Annotated[float, Bounds(1e-3, 1.0, "m")] = 0.03
    """epsilon_d of eq. (13), not given in the paper; goals nearer to an obstacle are biased."""


@dataclass(frozen=True)
class Control:
    method: Literal["gauss_newton", "network", "actions"] = "gauss_newton"
    solver: Literal["direct", "xpbd"] = "direct"
    """Of the model that predicts. `xpbd` is the paper's rod with `[control.paper]`, for the methods
    `network` and `actions`; `adapt` is then its gradient descent (15) on all five parameters."""
    planner: bool = True
    adapt: bool = False
    clearance: Annotated[float, Bounds(0.0, 0.2, "m")] = 0.012
    """Wanted between the rope's surface and every obstacle that is no support."""
    horizon: Annotated[int, Bounds(1, 100)] = 5
    time_step: Annotated[float, Bounds(1e-3, 0.2, "s")] = 0.05
    iterations: Annotated[int, Bounds(1, 50)] = 1
    """Linearisations a horizon; each goes on from the horizon before."""
    speed_weight: Annotated[float, Bounds(0.0, 100.0, "s^2")] = 0.02
    """On the squared velocity that `gauss_newton` adds to the path's, against the mean squared
    node distance."""
    acceleration_weight: Annotated[float, Bounds(0.0, 100.0, "s^4")] = 2e-4
    """On the squared change of that velocity."""
    paper: PaperControl = PaperControl()


@dataclass(frozen=True)
class Limits(MotionLimits):
    """Of the grippers."""

    speed: Annotated[float, Bounds(0.001, 2.0, "m/s")] = 0.5
    acceleration: Annotated[float, Bounds(0.01, 20.0, "m/s^2")] = 2.0
    jerk: Annotated[float, Bounds(0.1, 1000.0, "m/s^3")] = 40.0
    angular_speed: Annotated[float, Bounds(0.01, 6.0, "rad/s")] = 1.5
    angular_acceleration: Annotated[float, Bounds(0.1, 60.0, "rad/s^2")] = 6.0
    angular_jerk: Annotated[float, Bounds(1.0, 3000.0, "rad/s^3")] = 120.0
    joint_speed: Annotated[float, Bounds(0.01, 3.2, "rad/s")] = 1.6
    joint_acceleration: Annotated[float, Bounds(0.1, 30.0, "rad/s^2")] = 5.2
    workspace: tuple[Place, Place] = ((-0.8, -0.8, 0.01), (0.8, 0.8, 1.2))
    """Lowest and highest corner of the box that the grips stay in."""
    keep_out: Annotated[float, Bounds(0.0, 0.5, "m")] = 0.005
    """Least distance between a gripper's body and an obstacle."""
    gripper_radius: Annotated[float, Bounds(0.001, 0.2, "m")] = 0.012
    """Of the capsule that stands for a gripper."""
    gripper_height: Annotated[float, Bounds(0.0, 0.5, "m")] = 0.06
    """From the grip to the far end of that capsule."""
    spacing: Annotated[float, Bounds(0.0, 1.0, "m")] = 0.03
    """Least distance between the two grips."""
    overstretch: Annotated[float, Bounds(0.1, 1.0)] = 0.99
    """Most distance between the grips, round obstacles, as a fraction of the rope's length."""
    pull: Annotated[float, Bounds(0.1, 200.0, "N")] = 20.0
    """Most change of the force at a gripper since it was armed, where its arm feels forces."""

    @property
    def gripper_reach(self) -> float:
        """From the grip to the centre of that capsule's far cap [m]."""
        return max(self.gripper_height - self.gripper_radius, 0.0)

    def __post_init__(self) -> None:
        low, high = np.array(self.workspace)
        if np.any(low >= high):
            raise ValueError(f"workspace = {[list(c) for c in self.workspace]}: low corner first")


@dataclass(frozen=True)
class Run:
    time_limit: Annotated[float, Bounds(0.1, 3600.0, "s")] = 10.0
    tolerance: Annotated[float, Bounds(1e-6, 0.5, "m")] = 0.003
    """Mean node distance that counts as reached."""


@dataclass(frozen=True)
class Event:
    """Something that happens at a given time of a run."""

    time: Annotated[float, Bounds(0.0, 3600.0, "s")]
    """Since the start of the run."""
    add_obstacle: Obstacle | None = None
    move_obstacle: str = ""
    """Name of the obstacle that goes to `position`."""
    remove_obstacle: str = ""
    position: Place | None = None
    goal: Shape | None = None

    def __post_init__(self) -> None:
        actions = [self.add_obstacle, self.move_obstacle, self.remove_obstacle, self.goal]
        if sum(bool(a) for a in actions) != 1:
            raise ValueError(
                "an event is one of add_obstacle, move_obstacle, remove_obstacle and goal"
            )
        if bool(self.move_obstacle) != (self.position is not None):
            raise ValueError("move_obstacle and position go together")
