# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Publishes link, robot and joint commands as /diagnostics (REP 107)."""

from __future__ import annotations

from dataclasses import asdict
import math

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from quad_description import (
    EMPTY_BATTERY,
    LOW_BATTERY,
    RobotState,
)

from ..commander import CommandCounters
from ..link import latency_problem, LinkState, LinkStatus
from ..protocol import Fault, ParserCounters
from ..report import FAULT_TEXTS
from ..serial_robot import COMMANDS, LINK, ROBOT

HOT_SERVO = 65.0  # [°C]
GRAVITY_ERROR = math.radians(15.0)  # [rad] between accelerometer and attitude
MAX_DAMAGE_RATIO = 0.01  # of the frames, above which a cable is bad

UNCHECKED = (
    'the IMU was not compared with gravity, nor its gyro with turning by hand, so the '
    'controller does not level: ros2 run quad_hardware calibrate imu'
)
"""What is said of an attitude whose signs may be wrong."""

_LINK_LEVELS = {
    LinkState.CONNECTING: DiagnosticStatus.ERROR,
    LinkState.FAILED: DiagnosticStatus.ERROR,
    LinkState.WAITING: DiagnosticStatus.WARN,
    LinkState.RUNNING: DiagnosticStatus.OK,
    LinkState.STALE: DiagnosticStatus.STALE,
    LinkState.REFUSED: DiagnosticStatus.ERROR,
    LinkState.STOPPED: DiagnosticStatus.ERROR,
}


class LinkDiagnostic:
    """Describes the serial link; damage is counted since the last call."""

    def __init__(self) -> None:
        # what is wrong with its frames since the last look; empty while they are good
        self.damage = ''
        self._frames = self._damaged = 0

    def describe(
        self, node: str, port: str, status: LinkStatus, recording: str = ''
    ) -> DiagnosticStatus:
        """Describe the link and the last black box file; restart the counting."""
        level, message = _LINK_LEVELS[status.state], status.detail
        parser = status.parser
        frames, damaged = self._since(parser)
        self.damage = ''
        if damaged > MAX_DAMAGE_RATIO * max(frames, 100):
            self.damage = f'{damaged} damaged and {frames} good frames lately; is the cable loose?'
        if level == DiagnosticStatus.OK and self.damage:
            level, message = DiagnosticStatus.WARN, self.damage
        if level == DiagnosticStatus.OK and (slow := latency_problem(port, status.latency)):
            level, message = DiagnosticStatus.WARN, slow
        values = {
            'state': status.state.value,
            'protocol': status.protocol,
            'baud': status.baud,
            'firmware': status.firmware,
            'connections': status.connections,
            'report_age': '' if math.isinf(status.age) else f'{status.age:.3f}',
            'latency_timer': '' if status.latency is None else f'{status.latency:.3f}',
            'reports_refused': status.refused,
            'black_box': recording,
            'commands_sent': status.commands,
            'commands_dropped': status.dropped,
            **asdict(parser),
            **asdict(status.dialect),
        }
        return _status(level, f'{node}: {LINK}', message, port, values)

    def _since(self, parser: ParserCounters) -> tuple[int, int]:
        """Return the valid and damaged frames since the last call."""
        since = parser.frames - self._frames, parser.damaged - self._damaged
        self._frames, self._damaged = parser.frames, parser.damaged
        # another connection counts from 0
        return since if min(since) >= 0 else (parser.frames, parser.damaged)


def robot_diagnostic(
    node: str,
    port: str,
    state: RobotState,
    status: LinkStatus,
    *,
    gravity_error: float | None,
    recording: str = '',
) -> DiagnosticStatus:
    """Describe battery, servos and IMU.

    Args:
        gravity_error: Angle between accelerometer and attitude [rad]; None if unknown.
        recording: Last black box file about a robot fault; empty if none.
    """
    level, message = DiagnosticStatus.OK, 'no faults'
    signs_checked = state.imu is not None and not state.imu.is_uncertain
    if not signs_checked:
        level, message = DiagnosticStatus.WARN, UNCHECKED
    charge = state.battery
    hot = [motor for motor, t in state.temperatures.items() if t > HOT_SERVO]
    if gravity_error is not None and gravity_error > GRAVITY_ERROR:
        level = DiagnosticStatus.WARN
        angle = f'{math.degrees(gravity_error):.0f} degrees'
        message = (
            f'accelerometer and attitude disagree by {angle}; restart the robot on level ground'
        )
    if hot:
        level = DiagnosticStatus.WARN
        message = f'hot servos: {", ".join(map(str, hot))}'
    if charge is not None and charge < LOW_BATTERY:
        empty = charge < EMPTY_BATTERY
        level = DiagnosticStatus.ERROR if empty else DiagnosticStatus.WARN
        message = f'battery at {100.0 * charge:.0f} %; charge it'
    faults = Fault(state.faults & sum(Fault))
    if state.servo_problem:
        level, message = DiagnosticStatus.ERROR, state.servo_problem
    if state.imu_problem:
        level = DiagnosticStatus.ERROR
        message = f'{state.imu_problem}; lie down, then switch the robot off and on'
    if faults:
        level = DiagnosticStatus.ERROR
        message = f'the robot reports {"; ".join(FAULT_TEXTS[f] for f in Fault if f in faults)}'
    values = {
        'battery': '' if charge is None else f'{100.0 * charge:.0f}',
        'voltage': '' if state.voltage is None else f'{state.voltage:.2f}',
        'faults': state.faults,
        'imu_signs_checked': signs_checked,
        'gravity_error': '' if gravity_error is None else f'{gravity_error:.3f}',
        'joint_velocity_error': ''
        if state.joints is None
        else f'{state.joints.velocity_error:.2f}',
        'hottest_servo': max(state.temperatures.values(), default=0.0),
        'implausible_reports': status.refused,
        'last_implausible': status.refusal,
        'black_box': recording,
    }
    return _status(level, f'{node}: {ROBOT}', message, port, values)


def command_diagnostic(node: str, port: str, counters: CommandCounters) -> DiagnosticStatus:
    """Describe the handling of joint commands; restart the counting."""
    level = DiagnosticStatus.WARN if counters.troubled else DiagnosticStatus.OK
    message = counters.reason if counters.troubled else f'{counters.received} received'
    if counters.loss:
        level = DiagnosticStatus.ERROR
        message = f'{counters.loss}; {message}' if counters.troubled else counters.loss
    values = {k: v for k, v in asdict(counters).items() if k != 'troubled'}
    counters.troubled, counters.largest_step = False, 0.0
    return _status(level, f'{node}: {COMMANDS}', message, port, values)


def _status(
    level: bytes, name: str, message: str, hardware: str, values: dict[str, object]
) -> DiagnosticStatus:
    pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    return DiagnosticStatus(
        level=level, name=name, message=message, hardware_id=hardware, values=pairs
    )
