# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_teleop twist_mux``: multiplexes several velocity sources to one robot."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
import sys
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from std_msgs.msg import Bool

from node_runner import (
    destroyed_when_refused,
    given_values,
    ParameterReader,
    refuse_misspelt,
    refuse_similar,
    run_node,
)

from ..exceptions import CommandError, SettingError, TeleopError
from ..mux import DEFAULTS, Input, Inputs, Multiplexer

WATCH_PERIOD = 0.05  # [s] between two looks whether the active source fell silent
DIAGNOSTIC_PERIOD = 1.0  # [s]
GROUPS = ('topics.', 'locks.')  # what the parameters of sources and locks begin with
FIELDS = ('topic', 'timeout', 'priority')
MAX_PRIORITY = 255
MAX_TIMEOUT = 1e6  # [s]


class TwistMux(Node):
    """Forwards the source with the highest priority to ``cmd_vel_out``."""

    @destroyed_when_refused
    def __init__(self) -> None:
        """Read the parameters and subscribe.

        Raises:
            ParameterError: A parameter is misspelt or of the wrong type.
            SettingError: The sources and locks are invalid.
        """
        super().__init__('twist_mux')
        read = ParameterReader(self)
        meaning = 'TwistStamped in and out, instead of Twist'
        stamped = read.flag('use_stamped', meaning, default=False)
        inputs = _inputs(self, read)
        self._mux = Multiplexer(inputs)
        self._type: Any = TwistStamped if stamped else Twist
        self._output = self.create_publisher(self._type, 'cmd_vel_out', 1)
        self._diagnostics = self.create_publisher(DiagnosticArray, 'diagnostics', 10)
        for source in inputs.sources:
            take = partial(self._velocity, source.name)
            self.create_subscription(self._type, source.topic, take, 1)
        for lock in inputs.locks:
            self.create_subscription(Bool, lock.topic, partial(self._lock, lock.name), 1)
        # a simulated clock that stands still must not keep the robot moving
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(WATCH_PERIOD, self._watch, clock=steady)
        self.create_timer(DIAGNOSTIC_PERIOD, self._diagnose, clock=steady)
        self._log_inputs(inputs)

    def _velocity(self, name: str, message: Any) -> None:  # noqa: ANN401
        twist = message.twist if isinstance(message, TwistStamped) else message
        linear, angular = twist.linear, twist.angular
        parts = (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
        try:
            if self._mux.velocity(name, parts, time.monotonic()):
                self._output.publish(message)
        except CommandError as error:
            self.get_logger().warning(str(error), throttle_duration_sec=1.0)

    def _lock(self, name: str, message: Bool) -> None:
        self._mux.lock(name, message.data, time.monotonic())
        self._watch()

    def _watch(self) -> None:
        if self._mux.zero_due(time.monotonic()):
            message = self._type()
            if isinstance(message, TwistStamped):
                message.header.stamp = self.get_clock().now().to_msg()
            self._output.publish(message)

    def _diagnose(self) -> None:
        now, mux = time.monotonic(), self._mux
        active, values = mux.active(now), {}
        for each in mux.inputs.sources:
            state = 'masked' if mux.is_masked(each, now) else 'unmasked'
            values[f'velocity {each.name}'] = f'{state} {_text(each)}'
        for each in mux.inputs.locks:
            state = 'locked' if mux.is_locked(each, now) else 'free'
            values[f'lock {each.name}'] = f'{state} {_text(each)}'
        values['current priority'] = str(mux.lock_priority(now))
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK,
            name='twist_mux: Twist mux status',
            message=f'{active.name} is active' if active else 'no source is active',
            hardware_id='none',
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _log_inputs(self, inputs: Inputs) -> None:
        for kind, group in (('source', inputs.sources), ('lock', inputs.locks)):
            for each in sorted(group, key=lambda one: -one.priority):
                self.get_logger().info(f'{kind} {each.name}: {_text(each)}')


def _inputs(node: Node, read: ParameterReader) -> Inputs:
    """Read sources and locks; use the defaults if no parameter sets any.

    Raises:
        ParameterError: A parameter is misspelt, of the wrong type or out of range.
        SettingError: A parameter is unknown or missing, or parameters contradict each other.
    """
    given = given_values(node)
    sources, locks = (_group(prefix, given, read) for prefix in GROUPS)
    unknown = refuse_misspelt(node)
    if wrong := [name for name in unknown if name.startswith(GROUPS)]:
        raise SettingError(f'unknown parameter {wrong[0]}; there are {", ".join(FIELDS)}')
    refuse_similar((name.partition('.')[0] for name in unknown), ('topics', 'locks'))
    if not sources and not locks:
        return DEFAULTS
    if not sources:
        raise SettingError('there are locks but no topics: nothing could ever be forwarded')
    seen: dict[str, str] = {}
    for each in (*sources, *locks):
        if each.topic in seen:
            raise SettingError(f'{seen[each.topic]} and {each.name} both name {each.topic!r}')
        seen[each.topic] = each.name
    return Inputs(sources, locks)


def _group(prefix: str, given: Mapping[str, object], read: ParameterReader) -> tuple[Input, ...]:
    paths = {name.rpartition('.')[0] for name in given if name.startswith(prefix)}
    inputs = []
    for path in sorted(paths - {prefix.rstrip('.')}):
        if missing := [field for field in FIELDS if f'{path}.{field}' not in given]:
            raise SettingError(f'{path}.{missing[0]} is missing')
        topic = read.text(f'{path}.topic', '', 'name of the topic')
        if not topic:
            raise SettingError(f'{path}.topic is empty: name the topic')
        timeout = read.number(f'{path}.timeout', 0.0, (0.0, MAX_TIMEOUT), '[s]; 0: never stale')
        priority = read.whole(f'{path}.priority', 0, (0, MAX_PRIORITY), 'the highest is active')
        inputs.append(Input(path.removeprefix(prefix), topic, timeout, priority))
    return tuple(inputs)


def _text(each: Input) -> str:
    timeout = f'{each.timeout:g} s' if each.timeout else 'no'
    return f'({each.topic}, priority {each.priority}, {timeout} time-out)'


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_node('twist_mux', TwistMux, TeleopError)


if __name__ == '__main__':
    sys.exit(main())
