"""Simulated arm: the dynamics of any URDF in MuJoCo, with servo lag, torque limits and a gripper.

It is the example of a driver of its own (`lariat.protocols.Arm`), and plays every arm from outside
that has no address. Links have the masses and inertias of the URDF and collide with nothing: the
gateway's rules keep them apart. Gravity is compensated, as the controllers of arms do.
"""

# pyright: reportAttributeAccessIssue=false
# MuJoCo has no stubs.
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]  # its wheel lives beside site-packages

from lariat.arms.kinematics import UrdfKinematics
from lariat.configuration import ConfigurationError
from lariat.geometry.poses import Pose
from lariat.protocols.arm import ArmFacts, ArmReading, ArmSetup, Joints


@dataclass(frozen=True)
class SimulatedArmSettings:
    """Drives and gripper of a simulated arm."""

    time_step: float = 0.002
    """Time step of the simulation [s]."""
    servo_lag: float = 0.03
    """Time constant with which the servo's set point follows the wanted angle [s]."""
    bandwidth: float = 60.0
    """Angular frequency of the position loop of every joint [rad/s]."""
    armature: float = 0.1
    """Inertia of a drive's rotor at its joint [kg m^2]."""
    power_time: float = 0.4
    """Time from the request to the drives' readiness [s]."""
    finger_stroke: float = 0.04
    """Travel of the finger from open to closed [m]."""
    finger_force: float = 40.0
    """Force limit of the finger [N]."""


class SimulatedArm:
    """Arm in MuJoCo with a finger at its flange."""

    facts = ArmFacts(simulated=True, force_sensing=False)

    def __init__(self, setup: ArmSetup, settings: SimulatedArmSettings | None = None) -> None:
        """Create the arm at the scenario's start, with its power off."""
        # Imported late: the gateway of any other arm runs without MuJoCo.
        try:
            import mujoco
        except ModuleNotFoundError as error:
            raise ConfigurationError(
                "the simulated arm needs MuJoCo; run in the clone: pip install -e '.[simulation]'"
            ) from error
        self._mujoco, self._settings = mujoco, settings or SimulatedArmSettings()
        here = Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
        arm = UrdfKinematics(setup.urdf, setup.flange, here, here).model
        self._model = _dynamics(mujoco, arm, self._settings)
        self._simulation = mujoco.MjData(self._model)
        self._count = arm.nq
        self._time: float | None = None
        self._powered = False
        self._ready_at: float | None = None
        """Time at which the drives are ready [s]; None before the first step with power."""
        self._closing = True
        self.place(setup.start)

    def place(self, joints: Joints) -> None:
        """Put the arm at rest at some joint angles; only a simulation can."""
        state = self._simulation
        state.qpos[: self._count] = state.ctrl[: self._count] = joints
        state.act[: self._count] = joints
        state.qvel[:] = 0.0
        closed = self._settings.finger_stroke * self._closing
        state.qpos[self._count] = state.ctrl[self._count] = closed
        self._mujoco.mj_forward(self._model, state)

    def enable(self) -> None:
        self._powered = True

    def disable(self) -> None:
        self._powered, self._ready_at = False, None

    def set_gripper(self, close: bool) -> None:
        self._closing = close
        self._simulation.ctrl[self._count] = self._settings.finger_stroke * close

    def close(self) -> None:
        self.disable()

    def step(self, time: float, target: Joints | None) -> ArmReading:
        state, settings = self._simulation, self._settings
        elapsed = 0.0 if self._time is None else time - self._time
        self._time = time
        if self._powered and self._ready_at is None:
            self._ready_at = time + settings.power_time
        ready = self._ready_at is not None and time >= self._ready_at
        if ready and target is not None:
            state.ctrl[: self._count] = target
        if not self._powered:
            # Brakes engage where the arm stands.
            state.qvel[: self._count] = 0.0
            state.ctrl[: self._count] = state.act[: self._count] = state.qpos[: self._count]
        steps = round(elapsed / settings.time_step)
        if steps > 0:
            self._mujoco.mj_step(self._model, state, nstep=steps)
        gap = abs(state.qpos[self._count] - settings.finger_stroke)
        return ArmReading(
            joints=state.qpos[: self._count].copy(),
            velocities=state.qvel[: self._count].copy(),
            ready=ready,
            powered=self._powered,
            gripper_closed=self._closing and gap < 0.1 * settings.finger_stroke,
            mode="running" if ready else "powering on" if self._powered else "off",
        )


def _dynamics(mujoco, arm: pinocchio.Model, settings: SimulatedArmSettings):
    """Compile a MuJoCo model with the links, the drives and the finger of an arm."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.timestep = settings.time_step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    body = spec.worldbody
    for k in range(1, arm.njoints):
        placement, inertia = arm.jointPlacements[k], arm.inertias[k]
        body = body.add_body(name=arm.names[k], gravcomp=1.0, **_pose(placement))
        body.mass = max(float(inertia.mass), 1e-3)
        body.ipos = np.array(inertia.lever)
        matrix = np.array(inertia.inertia) + 1e-6 * np.eye(3)
        body.fullinertia = matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        body.explicitinertial = True
        joint = body.add_joint(
            name=arm.names[k], type=mujoco.mjtJoint.mjJNT_HINGE, axis=_axis(arm, k)
        )
        joint.armature = settings.armature
        joint.range = [float(arm.lowerPositionLimit[k - 1]), float(arm.upperPositionLimit[k - 1])]
    finger = body.add_body(name="finger", gravcomp=1.0)
    finger.mass, finger.explicitinertial = 0.05, True
    finger.inertia = [1e-5] * 3
    slide = finger.add_joint(name="finger", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 1, 0])
    slide.range, slide.limited = [0.0, settings.finger_stroke], True
    _add_drives(mujoco, spec, arm, settings)
    return spec.compile()


def _add_drives(mujoco, spec, arm: pinocchio.Model, settings: SimulatedArmSettings) -> None:
    """Add a position servo for every joint and for the finger."""
    # The gains suit the inertia of the stretched arm, so that no pose makes a joint ring.
    reach = float(sum(np.linalg.norm(np.array(p.translation)) for p in arm.jointPlacements))
    for k in range(1, arm.njoints):
        carried = sum(float(arm.inertias[j].mass) for j in range(k, arm.njoints))
        inertia = settings.armature + carried * (0.3 * reach) ** 2
        torque = float(arm.effortLimit[k - 1])
        servo = spec.add_actuator(name=arm.names[k], target=arm.names[k])
        servo.trntype = mujoco.mjtTrn.mjTRN_JOINT
        servo.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
        servo.dynprm[0] = settings.servo_lag
        _set_gains(
            mujoco, servo, inertia * settings.bandwidth**2, 2.0 * inertia * settings.bandwidth
        )
        servo.forcerange, servo.forcelimited = [-torque, torque], True
    grip = spec.add_actuator(name="finger", target="finger")
    grip.trntype = mujoco.mjtTrn.mjTRN_JOINT
    _set_gains(mujoco, grip, 2000.0, 60.0)
    grip.forcerange, grip.forcelimited = [-settings.finger_force, settings.finger_force], True


def _set_gains(mujoco, actuator, stiffness: float, damping: float) -> None:
    """Make an actuator a position servo [N m/rad, N m s/rad]."""
    actuator.gaintype = mujoco.mjtGain.mjGAIN_FIXED
    actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    actuator.gainprm[0] = stiffness
    actuator.biasprm[1], actuator.biasprm[2] = -stiffness, -damping


def _axis(arm: pinocchio.Model, joint: int) -> np.ndarray:
    """Axis of a revolute joint in its own frame."""
    turned = np.zeros(arm.nv)
    turned[joint - 1] = 1.0
    state = arm.createData()
    pinocchio.forwardKinematics(arm, state, pinocchio.neutral(arm), turned)
    # Only this joint turns, so that its velocity in its own frame is its axis.
    return np.array(pinocchio.getVelocity(arm, state, joint).angular)


def _pose(placement: pinocchio.SE3) -> dict[str, np.ndarray]:
    """Position and quaternion of a placement, as MuJoCo takes them."""
    x, y, z, w = pinocchio.Quaternion(np.array(placement.rotation)).coeffs()
    return {"pos": np.array(placement.translation), "quat": np.array([w, x, y, z])}
