# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Requests of a user to the robot, and the text that shows its state on a terminal.

Lengths are in [m], angles in [rad], velocities in [m/s] and [rad/s], in base_link (REP 103).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import auto, Enum
import math

from operator_input import StatusPart, Style
from quad_description.rotations import from_rpy, Quaternion
from robot_primitives import setting

from .exceptions import SettingError

SPEED_STEP = 0.1  # share by which a key makes faster or slower
MIN_SPEED = 0.01  # [m/s] and [rad/s]: slower is standing, and could not be made faster again


class Mode(Enum):
    """A mode of ``set_mode`` that a key or button requests; the value is its name."""

    LIE = 'lie'
    STAND = 'stand'
    WALK = 'walk'
    TURN = 'turn'
    GET_UP = 'get_up'

    @property
    def moves(self) -> bool:
        """Whether the robot follows velocity commands in this mode."""
        return self in {Mode.WALK, Mode.TURN}


class RobotRequest(Enum):
    """User requests other than velocities, poses and modes."""

    STOP = auto()
    """Stop the whole robot: gait or policy end, whatever follows the velocity."""

    CLEAR_FAULT = auto()
    """Forget the latched faults."""


@dataclass(frozen=True, slots=True)
class Velocity:
    """Velocity of the body: forward, to the left, and turning to the left."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def at(self, speeds: Speeds) -> Velocity:
        """Scale this direction by the two speeds; its components are -1 to 1."""
        return Velocity(self.x * speeds.linear, self.y * speeds.linear, self.yaw * speeds.angular)


ZERO = Velocity()
"""Stand still."""


def rest_of(_: Velocity | None) -> Velocity:
    """Return the velocity that ends a motion."""
    return ZERO


@dataclass(frozen=True, slots=True)
class Speeds:
    """Walking and turning speeds, within limits.

    Raises:
        SettingError: A speed is above its limit or too low.
    """

    linear: float = 0.15
    angular: float = 0.6
    linear_limit: float = 0.4
    angular_limit: float = 2.0

    def __post_init__(self) -> None:
        for name, speed, limit in (
            ('speed', self.linear, self.linear_limit),
            ('turn', self.angular, self.angular_limit),
        ):
            if not MIN_SPEED <= speed <= limit:
                raise SettingError(
                    f'{name} is {speed}: it must be between {MIN_SPEED} and its limit {limit}; '
                    f'change {name} or {name}_limit'
                )

    def scaled(self, linear: int, angular: int) -> Speeds:
        """Change the speeds by steps of 10 %, negative to slow down, within the limits."""
        return replace(
            self,
            linear=_scaled(self.linear, linear, self.linear_limit),
            angular=_scaled(self.angular, angular, self.angular_limit),
        )


@dataclass(frozen=True, slots=True)
class BodyPose:
    """Offset from the normal body pose: up, right side down, nose down, turned left.

    Roll, pitch and yaw are about fixed axes (REP 103).
    """

    height: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0

    def quaternion(self) -> Quaternion:
        """Return the attitude as a unit quaternion (x, y, z, w)."""
        return from_rpy(self.roll, self.pitch, self.yaw)


NEUTRAL = BodyPose()
"""As the robot stands by itself."""


@dataclass(frozen=True, slots=True)
class PoseSteps:
    """Pose change per keystroke, and the limit to either side.

    Raises:
        SettingError: A step is not positive, or above its limit.
    """

    height_step: float = setting(0.005, 0.0005, 0.1, 'Lift of a stroke [m]')
    height_limit: float = setting(0.03, 0.0005, 0.3, 'Highest lift [m]')
    angle_step: float = setting(0.05, 0.001, 0.5, 'Tilt of a stroke [rad]')
    angle_limit: float = setting(0.3, 0.001, 0.8, 'Largest tilt [rad]')

    def __post_init__(self) -> None:
        for name, step, limit in (
            ('height', self.height_step, self.height_limit),
            ('angle', self.angle_step, self.angle_limit),
        ):
            if not 0.0 < step <= limit:
                raise SettingError(
                    f'{name}_step is {step}: it must be above 0 and at most {name}_limit, {limit}'
                )

    def moved(self, pose: BodyPose, direction: BodyPose) -> BodyPose:
        """Return the pose after one keystroke, clamped to the limits.

        Args:
            pose: Present pose.
            direction: Step of each component, 1 or -1 for those that change.
        """

        def angle(value: float, steps: float) -> float:
            return _moved(value, steps, self.angle_step, self.angle_limit)

        return BodyPose(
            _moved(pose.height, direction.height, self.height_step, self.height_limit),
            angle(pose.roll, direction.roll),
            angle(pose.pitch, direction.pitch),
            angle(pose.yaw, direction.yaw),
        )


def _scaled(speed: float, steps: int, limit: float) -> float:
    return min(max(speed * (1.0 + SPEED_STEP * steps), MIN_SPEED), limit)


def _moved(value: float, steps: float, step: float, limit: float) -> float:
    moved = min(max(value + steps * step, -limit), limit)
    return 0.0 if abs(moved) < step / 1000 else moved  # rounding must not leave the middle


NAME = 'controller_node: state'
"""Name of the status, after a namespace if there is one."""

ERROR = 2  # of diagnostic_msgs/DiagnosticStatus: a fault is latched
REPORT_TIMEOUT = 3.0  # [s] after which a report is history
FOLLOWS_VELOCITIES = frozenset({'walk', 'turn', 'policy'})
"""Modes in which velocities do anything."""


@dataclass(frozen=True, slots=True)
class ControllerReport:
    """A status report of the controller."""

    state: str  # what the robot does: ``walk``, ``to stand``, ``fault``
    goal: str  # the mode that it is on its way to
    has_fault: bool  # whether a fault is latched
    message: str  # what is not, in words
    time: float  # when it came [s]

    def is_fresh(self, now: float) -> bool:
        """Return whether the report is recent enough to use at a time [s]."""
        return now - self.time < REPORT_TIMEOUT


def read_report(
    name: str, level: int, message: str, values: Mapping[str, str], now: float
) -> ControllerReport | None:
    """Parse a /diagnostics status received at a time [s]; None if not the controller's."""
    if not name.endswith(NAME) or 'state' not in values:
        return None
    state = values['state']
    return ControllerReport(state, values.get('goal', state), level == ERROR, message, now)


def state_part(mode: Mode | None, report: ControllerReport | None) -> StatusPart:
    """Format the reported controller state, or else the mode granted last."""
    if report is not None:
        return report.state, Style.RED if report.has_fault else Style.BOLD
    return mode.value if mode else 'mode ?', Style.BOLD


def motion_parts(
    speeds: Speeds, velocity: Velocity | None, pose: BodyPose, *, has_subscriber: bool
) -> list[StatusPart]:
    """Format the speed settings, the requested velocity and the body pose."""
    parts = [(f'{speeds.linear:.2f} m/s {speeds.angular:.2f} rad/s', Style.BOLD)]
    if velocity is None:
        parts.append((f'{"idle":<27}', Style.DIM))
    else:
        way = f'x {velocity.x:+.2f} y {velocity.y:+.2f} yaw {velocity.yaw:+.2f}'
        parts.append((way, Style.GREEN))
    if not has_subscriber:
        parts.append(('no subscriber', Style.YELLOW))
    if pose != NEUTRAL:
        angles = ' '.join(f'{math.degrees(a):+.0f}' for a in (pose.roll, pose.pitch, pose.yaw))
        parts.append((f'body {pose.height * 1000:+.0f} mm {angles} deg', Style.PLAIN))
    return parts


def hint(
    mode: Mode | None,
    report: ControllerReport | None,
    velocity: Velocity | None,
    *,
    has_subscriber: bool,
) -> str:
    """Return why the robot may not follow commands; empty if there is no reason."""
    if report is not None and report.has_fault:
        return f'fault: {report.message}; Backspace clears it, 0 lies down, 9 gets up'
    if velocity is None or not has_subscriber:
        return ''
    moves = report.goal in FOLLOWS_VELOCITIES if report else mode is None or mode.moves
    if moves:
        return ''
    state, _ = state_part(mode, report)
    return f'the robot does not walk now ({state}): press 2 to walk, 3 to turn'
