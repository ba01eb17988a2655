"""Rope shaping by Gymnasium's interface.

`gymnasium.make("environments.shape_control:lariat/ShapeControl-v0")` makes the environment,
`gymnasium.make_vec` several of them. Importing this module registers it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal, get_args

import gymnasium
import numpy as np
from gymnasium import spaces
from jaxtyping import Float64, UInt8

from environments.grip_motion import GripMotion
from environments.scenes import Kind, sample_scene
from lariat.geometry import polylines
from lariat.geometry.grippers import gripper_points
from lariat.geometry.obstacles import chain_clearance, signed_distance
from lariat.geometry.poses import Pose
from lariat.scenario import Scenario, load
from lariat.simulation.camera.rgbd_camera import Frame, RgbdCamera
from lariat.simulation.camera.sensor_noise import SensorNoise
from lariat.simulation.camera.true_camera import true_camera
from lariat.simulation.world import World
from lariat.trajectory import SECOND

ID = "lariat/ShapeControl-v0"
"""Id of the environment."""
StaticKind = Literal["easy", "hard", "boxes", "slot", "rotating", "shapes"]
"""Kinds of scenes whose obstacles and goal stay."""
ROTATING_KINDS = ("rotating", "shapes")
"""Kinds of scenes whose grips rotate."""
MAX_COORDINATE = 10.0
"""Bound of the coordinates of an observation [m]."""
TOUCH_PENALTY = 1.0
"""Reward that is lost in each step in which rope or grippers touch an obstacle [-]."""
EFFORT_WEIGHT = 0.01
"""Reward that is lost by actions at their bounds [-]."""


class ShapeControl(gymnasium.Env[dict[str, np.ndarray], np.ndarray]):
    """Shaping of a rope among obstacles by the velocities of both grips.

    An action holds the velocity of each grip, divided by its limit: linear, and angular where the
    scene's grips rotate. Speed, acceleration, workspace and the distance of the grips are kept
    within the limits of the scenario.

    An observation holds the nodes of the rope (or a colour and a depth image), those of the goal,
    and pose and velocity of both grips.

    The reward of a step is the negative mean node distance to the goal, divided by the rope's
    length, less penalties for touching and for effort. An episode is truncated at its time limit
    and never terminates: the rope is to stay at the goal.

    `info` holds `error` [m] (mean node distance of the true rope to the goal), `clearance` [m]
    (least distance of the rope's surface to an obstacle), `gripper_clearance` [m] and `touched`.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012

    def __init__(
        self,
        scene: StaticKind = "easy",
        plant: Literal["rod", "mujoco", "links"] = "rod",
        node_count: int = 40,
        plant_node_count: int | None = None,
        observation: Literal["nodes", "camera"] = "nodes",
        scene_count: int = 100,
        scene_seed: int = 0,
        period: float = 0.05,
        time_limit: float = 8.0,
        render_mode: str | None = None,
    ) -> None:
        """Create an environment.

        Args:
            scene: Kind of the scenes, as in `lariat bench goals`.
            plant: Simulator of the true rope.
            node_count: Number of observed nodes.
            plant_node_count: Number of nodes of the true rope; by default it has three edges for
                each observed one.
            observation: Nodes of the true rope, or images of a camera.
            scene_count: Number of scenes, one of which each episode draws.
            scene_seed: Seed of the scenes.
            period: Duration of a step [s].
            time_limit: Duration of an episode [s].
            render_mode: "rgb_array" for images from `render`.

        Raises:
            ValueError: The kind of scene is unknown, or its obstacles or goal change in a run.
        """
        if scene not in get_args(StaticKind):
            raise ValueError(
                f"scene must be one of {', '.join(get_args(StaticKind))}, got {scene!r}: the "
                "obstacles and the goal of an episode stay"
            )
        base = load("three-cylinders")
        self._base = replace(
            base,
            rope=replace(base.rope, node_count=node_count),
            plant=replace(
                base.plant,
                model=plant,
                rope=replace(base.plant.rope, node_count=plant_node_count),
            ),
        )
        self._kind: Kind = scene
        self._scene_count, self._scene_seed = scene_count, scene_seed
        self.period = period
        """Duration of a step [s]."""
        self._time_limit = time_limit
        self._observes_images = observation == "camera"
        self.render_mode = render_mode
        self._scenarios: dict[int, Scenario] = {}
        self._camera: RgbdCamera | None = None
        self.rotates = scene in ROTATING_KINDS
        """Whether the grips rotate."""
        self.action_space = spaces.Box(-1.0, 1.0, (2, 6 if self.rotates else 3), np.float32)
        self.observation_space = self._observations(node_count)  # pyright: ignore[reportAttributeAccessIssue]

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Begin an episode with the rope at rest.

        Args:
            seed: Seed of the draws of scenes.
            options: `{"scene": k}` takes scene k instead of a random one.
        """
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(self._scene_count))
        number = int((options or {}).get("scene", drawn))
        self._scenario = scenario = self._sampled(number)
        goal = scenario.nodes(scenario.goal)
        assert goal is not None
        self._goal = goal
        self._world = World(scenario)
        self._motion = GripMotion.at_rest(*self._world.grips)
        self._world.advance(*self._motion.ends, 0)
        self._steps = 0
        return self._observe(), self._measured() | {"scene": number}

    def step(
        self, action: np.ndarray
    ) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        """Advance by one period."""
        limits = self._scenario.limits
        command = np.zeros((2, 2, 3))
        command.reshape(2, 6)[:, : action.shape[1]] = np.clip(action, -1.0, 1.0)
        self._motion = self._motion.after(
            command * limits.speed_bounds,
            self.period,
            limits,
            limits.overstretch * self._scenario.rope.length,
        )
        self._steps += 1
        self._world.advance(*self._motion.ends, round(self._steps * self.period * SECOND))
        measured = self._measured()
        reward = (
            -measured["error"] / self._scenario.rope.length
            - TOUCH_PENALTY * measured["touched"]
            - EFFORT_WEIGHT * float(np.mean(np.square(action)))
        )
        truncated = self._steps * self.period >= self._time_limit - 1e-9
        return self._observe(), reward, False, truncated, measured

    def render(self) -> UInt8[np.ndarray, "h w 3"] | None:  # pyright: ignore
        """Return an image of the cell; None without a render mode."""
        return self._image().color if self.render_mode == "rgb_array" else None

    @property
    def scenario(self) -> Scenario:
        """Scenario of the episode."""
        return self._scenario

    @property
    def true_nodes(self) -> Float64[np.ndarray, "m 3"]:
        """Nodes of the true rope [m]."""
        return self._world.nodes

    def _sampled(self, number: int) -> Scenario:
        if number not in self._scenarios:
            self._scenarios[number] = sample_scene(self._kind, number, self._scene_seed, self._base)
        return self._scenarios[number]

    def _measured(self) -> dict[str, Any]:
        scenario, nodes = self._scenario, self._world.nodes
        solid = [o for o in scenario.bodies if not o.support]
        radius = scenario.plant_rope.diameter / 2.0
        grips = [Pose(*pose) for pose in zip(self._motion.positions, self._motion.orientations)]  # noqa: B905
        bodies = gripper_points(*grips, scenario.limits.gripper_reach)
        gripper = min(float(np.min(signed_distance(bodies, o))) for o in solid)
        clearance = chain_clearance(nodes, radius, [*solid, *scenario.regions])
        gripper_clearance = gripper - scenario.limits.gripper_radius
        return {
            "error": float(np.linalg.norm(self._seen(nodes) - self._goal, axis=1).mean()),
            "clearance": clearance,
            "gripper_clearance": gripper_clearance,
            "touched": min(clearance, gripper_clearance) <= 0.0,
        }

    def _seen(self, nodes: Float64[np.ndarray, "m 3"]) -> Float64[np.ndarray, "n 3"]:
        count = self._base.rope.node_count
        return nodes if len(nodes) == count else polylines.resample_smooth(nodes, count)

    def _observe(self) -> dict[str, np.ndarray]:
        motion = self._motion
        observed = {
            "goal": self._goal,
            "grips": np.hstack([motion.positions, motion.orientations]),
            "velocities": motion.velocities.reshape(2, 6),
        }
        if self._observes_images:
            frame = self._image()
            images = {"color": frame.color, "depth": frame.depth}
        else:
            images = {}
            observed["nodes"] = self._seen(self._world.nodes)
        return {k: v.astype(np.float32) for k, v in observed.items()} | images

    def _image(self) -> Frame:
        scenario = self._scenario
        if self._camera is None:
            noise = SensorNoise(depth_sigma=scenario.sensing.depth_noise)
            self._camera = RgbdCamera(
                true_camera(scenario.camera_setups[0], scenario.plant),
                noise,
                rope_color=(255, 255, 255),
            )
        radius = scenario.plant_rope.diameter / 2.0
        return self._camera.take(self._world.nodes, radius, scenario.bodies, frame=self._steps)

    def _observations(self, node_count: int) -> spaces.Dict:
        limits = self._base.limits
        fastest = max(limits.speed, limits.angular_speed)

        def coordinates(*shape: int, bound: float = MAX_COORDINATE) -> spaces.Box:
            return spaces.Box(-bound, bound, shape, np.float32)

        observed: dict[str, spaces.Space[Any]] = {
            "goal": coordinates(node_count, 3),
            "grips": coordinates(2, 7),
            "velocities": coordinates(2, 6, bound=2.0 * fastest),
        }
        if self._observes_images:
            width, height = self._base.sensing.resolution
            observed["color"] = spaces.Box(0, 255, (height, width, 3), np.uint8)
            observed["depth"] = spaces.Box(0, 2**16 - 1, (height, width), np.uint16)
        else:
            observed["nodes"] = coordinates(node_count, 3)
        return spaces.Dict(observed)


if ID not in gymnasium.registry:
    gymnasium.register(ID, entry_point="environments.shape_control:ShapeControl")
