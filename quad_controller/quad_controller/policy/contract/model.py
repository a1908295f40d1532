# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The contract of a policy: its observation term by term, its actions, its rate.

Conventions: joints are in the policy's own order, positions in [rad], velocities in [rad/s],
vectors in the frame of the body (REP 103). A term is ``clip(value) * scale + offset``, as mjlab
and Isaac Lab compute it; the whole observation may be clipped after that, as legged_gym does.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple


class Source(Enum):
    """The quantity that an observation term contains."""

    LINEAR_VELOCITY = 'linear_velocity'
    """Of the body in [m/s], estimated; 3 numbers."""
    ANGULAR_VELOCITY = 'angular_velocity'
    """Of the body in [rad/s]; 3 numbers."""
    GRAVITY = 'gravity'
    """Direction of gravity, (0, 0, -1) upright; 3 numbers."""
    ORIENTATION = 'orientation'
    """Unit quaternion of the body in the world; 4 numbers."""
    COMMAND = 'command'
    """x and y in [m/s], yaw in [rad/s]; 3 numbers."""
    PHASE = 'phase'
    """Sine and cosine of a clock, zero while the robot shall stand; 2 numbers."""
    JOINT_POSITIONS = 'joint_positions'
    """In [rad], relative to the default pose or absolute; a number for each joint."""
    JOINT_VELOCITIES = 'joint_velocities'
    """In [rad/s]; a number for each joint."""
    LAST_ACTION = 'last_action'
    """What the policy answered one step before; a number for each joint."""
    FOOT_CONTACTS = 'foot_contacts'
    """1 for a foot on the ground, else 0, estimated; 4 numbers in the order of ``feet``."""
    HEIGHT_SCAN = 'height_scan'
    """Heights of the ground; nothing measures them, a flat ground has to be declared."""
    CONSTANT = 'constant'
    """Always the same numbers."""


FIXED_WIDTHS = {
    Source.LINEAR_VELOCITY: 3,
    Source.ANGULAR_VELOCITY: 3,
    Source.GRAVITY: 3,
    Source.ORIENTATION: 4,
    Source.COMMAND: 3,
    Source.PHASE: 2,
    Source.FOOT_CONTACTS: 4,
}
"""Numbers of the terms whose width depends on nothing."""

PER_JOINT = frozenset({Source.JOINT_POSITIONS, Source.JOINT_VELOCITIES, Source.LAST_ACTION})


class BodyFrame(Enum):
    """Frame of a vector; ``YAWED`` is the body frame turned by 180 degrees about z.

    The vendor's training environment (luwu_mjlab) mounts the IMU that way.
    """

    BASE = 'base'
    YAWED = 'yawed'


class QuaternionOrder(Enum):
    """Order of the components of a quaternion."""

    XYZW = 'xyzw'
    WXYZ = 'wxyz'


class HistoryLayout(Enum):
    """Layout of the history steps in the observation.

    ``PER_TERM``: all steps of the first term, then all of the second (Isaac Lab, mjlab).
    ``FRAMES``: whole observations one after another (legged_gym and its derivatives).
    """

    PER_TERM = 'per_term'
    FRAMES = 'frames'


class Newest(Enum):
    """Whether the newest history step comes first or last."""

    FIRST = 'first'
    LAST = 'last'


class HistoryStart(Enum):
    """Initial content of a history: its first step repeated, or zeros."""

    REPEAT = 'repeat'
    ZERO = 'zero'


@dataclass(frozen=True, slots=True)
class ObservationTerm:
    """One term of the observation."""

    name: str  # how its tool calls it
    source: Source  # what it is made of
    width: int  # numbers of one step
    scale: tuple[float, ...]  # for each number
    offset: tuple[float, ...]  # for each number, added after the scale
    # lowest and highest value before the scale; None for none
    clip: tuple[float, float] | None = None
    history: int = 1  # steps that are observed, 1 for the present one only
    frame: BodyFrame = BodyFrame.BASE  # of a velocity
    relative: bool = True  # whether joint positions count from the default pose
    quaternion: QuaternionOrder = QuaternionOrder.XYZW  # order of an orientation
    phase_period: float = 1.0  # of the clock in [s]
    phase_threshold: float = 0.0  # a command whose norm is smaller has no phase
    values: tuple[float, ...] = ()  # what a constant, or the scan of a flat ground, is
    feet: tuple[str, ...] = ()  # links of the feet whose contacts these are, in their order
    # of joint velocities in the training, rms in [rad/s]; None where it is unknown
    noise: float | None = None


@dataclass(frozen=True, slots=True)
class ActionContract:
    """Maps an action to a joint target: ``target = clip(action) * scale + offset``."""

    scale: tuple[float, ...]  # in [rad] for each joint
    offset: tuple[float, ...]  # in [rad] for each joint; as a rule the default pose
    # Range of each raw action; what was clipped is the last action. None for none.
    clip: tuple[tuple[float, float], ...] | None = None
    # range of each target in [rad]; None for none
    target_clip: tuple[tuple[float, float], ...] | None = None
    low_pass: float = 0.0  # cut-off of a filter of the targets in [Hz]; 0 for none
    output: str = ''  # name of the output that holds it; empty where there is one only


@dataclass(frozen=True, slots=True)
class RecurrentState:
    """An input that receives an output of the previous step; zero in the first step."""

    input: str
    output: str


class CommandRanges(NamedTuple):
    """Command ranges of the training: lowest and highest, [m/s] and [rad/s]."""

    x: tuple[float, float]
    y: tuple[float, float]
    yaw: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Gains:
    """Servo gains in the training, per joint: [N m/rad] and [N m s/rad]."""

    stiffness: tuple[float, ...]
    damping: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PolicyContract:
    """Everything on which a policy and the robot that runs it must agree."""

    joint_names: tuple[str, ...]  # joints in the order of observations and actions
    default_positions: tuple[float, ...]  # of the joints in [rad]
    period: float  # between two steps of the policy in [s]
    terms: tuple[ObservationTerm, ...]  # of the observation, in their order
    action: ActionContract  # what becomes of an answer
    # the whole observation stays within plus and minus this; None for no limit
    clip: float | None = None
    history_layout: HistoryLayout = HistoryLayout.PER_TERM  # how steps lie in it
    newest: Newest = Newest.LAST  # where the newest step is
    history_start: HistoryStart = HistoryStart.REPEAT  # what a history begins with
    recurrence: tuple[RecurrentState, ...] = ()  # inputs that are outputs of the step before
    commands: CommandRanges | None = None  # what it was trained for; None if unknown
    gains: Gains | None = None  # of its training; None if unknown
    robot: str = ''  # what it was trained for, for people
    kind: str = ''  # how it was made, for people

    @property
    def width(self) -> int:
        """Number of values in the whole observation."""
        return sum(term.width * term.history for term in self.terms)

    @property
    def velocity_noise(self) -> float | None:
        """Lowest joint velocity noise in the training, rms [rad/s]; None if unknown."""
        return min((term.noise for term in self.terms if term.noise is not None), default=None)

    def needs(self, source: Source) -> bool:
        """Return whether any observation term uses a source."""
        return any(term.source is source for term in self.terms)


# How training tools call the terms of an observation, and what they are made of here. Only what a
# name says in its tool stands here. The frame of an IMU's angular velocity is in no name but those
# of functions that take the root's (Isaac Lab, isaaclab.envs.mdp.observations).
RELATIVE = {'source': Source.JOINT_POSITIONS.value, 'relative': True}
ABSOLUTE = {'source': Source.JOINT_POSITIONS.value, 'relative': False}

NAMES = {
    Source.LINEAR_VELOCITY: ('base_lin_vel', 'lin_vel'),
    Source.ANGULAR_VELOCITY: ('base_ang_vel', 'ang_vel', 'gyro', 'imu_ang_vel'),
    Source.GRAVITY: ('gravity', 'gravity_vec', 'projected_gravity'),
    Source.COMMAND: (
        *('cmd', 'command', 'commands', 'generated_commands'),
        *('velocity_command', 'velocity_commands'),
    ),
    Source.PHASE: ('phase', 'gait_phase'),
    Source.JOINT_VELOCITIES: ('joint_vel', 'joint_vel_rel', 'dof_vel'),
    Source.LAST_ACTION: ('prev_action', 'last_action', 'last_actions', 'action', 'actions'),
    Source.FOOT_CONTACTS: ('foot_contact', 'feet_contact'),
    Source.HEIGHT_SCAN: ('height_scan',),
}
COMMON: dict[str, dict[str, Any]] = {
    **{name: {'source': source.value} for source, names in NAMES.items() for name in names},
    'root_quat_w': {'source': Source.ORIENTATION.value, 'order': 'wxyz'},
    'joint_pos_rel': RELATIVE,
}
"""Names that mean the same in all of them."""

MJLAB = COMMON | {'joint_pos': RELATIVE}
"""mjlab (and the vendor's training): ``joint_pos`` is relative to the default pose."""

ISAAC_LAB = COMMON | {
    'joint_pos': ABSOLUTE,
    'base_lin_vel': {'source': Source.LINEAR_VELOCITY.value, 'frame': 'base'},
    'base_ang_vel': {'source': Source.ANGULAR_VELOCITY.value, 'frame': 'base'},
}
"""Isaac Lab: velocities are those of the root, ``joint_pos`` is absolute."""

RL_SAR = COMMON | {'dof_pos': RELATIVE}
"""rl_sar and legged_gym: ``dof_pos`` is relative to the default pose."""
