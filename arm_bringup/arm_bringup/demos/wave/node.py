# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The wave as a ROS node inside the master's process."""

from __future__ import annotations

from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from std_srvs.srv import Trigger

from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt

from ...description import joint_limits
from .axis import AxisReport
from .plan import plan_wave, WaveStyle
from .source import REPORT_PERIOD, WaveReport, WaveSource

if TYPE_CHECKING:
    from arm_canopen import MasterProcess


class WaveNode(Node):
    """Offers ~/start and ~/stop, and says in /diagnostics how well the drives follow."""

    @destroyed_when_refused
    def __init__(self, master: MasterProcess) -> None:
        """Plan the wave for the drives of a running master; nothing moves yet.

        Args:
            master: The process that runs the bus.

        Raises:
            ParameterError: A parameter is misspelt.
            DescriptionError: Parameter robot_description is not usable.
            WaveError: The wave cannot be planned.
        """
        super().__init__('wave')
        self._master = master
        urdf = ParameterReader(self).text(
            'robot_description',
            '',
            'URDF of the robot as XML; the wave stays within its joint limits',
        )
        refuse_misspelt(self)
        style = WaveStyle()
        self._source = WaveSource(plan_wave(joint_limits(urdf), master.bus.joints, style), style)
        self._left: dict[str, str] = {}
        self._diagnostics = self.create_publisher(DiagnosticArray, 'diagnostics', 10)
        self.create_service(Trigger, '~/start', self._start)
        self.create_service(Trigger, '~/stop', self._stop)
        self.create_timer(REPORT_PERIOD, self._publish)

    def _start(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._master.attach(self._source)
        self._source.start()
        response.success = True
        response.message = (
            f'the wave takes in each of its {len(self._source.axes)} drives that is enabled, in '
            'cyclic position mode and moved by nothing else'
        )
        return response

    def _stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._source.stop()
        response.success = True
        response.message = f'stands still in {self._source.stop_duration:.1f} s'
        return response

    def _publish(self) -> None:
        report = self._source.report
        self._log_who_left(report)
        message = DiagnosticArray(status=[_motion_status(report), *map(_axis_status, report.axes)])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _log_who_left(self, report: WaveReport) -> None:
        before, self._left = self._left, {axis.name: axis.left for axis in report.axes}
        for name, reason in self._left.items():
            if reason and not before.get(name):
                self.get_logger().warning(f'{name} left the wave: {reason}')


def _motion_status(report: WaveReport) -> DiagnosticStatus:
    active = sum(axis.active for axis in report.axes)
    return DiagnosticStatus(
        level=DiagnosticStatus.OK,
        name='wave: motion',
        message=f'{report.state.value}, {active} of {len(report.axes)} axes',
        values=[KeyValue(key='state', value=report.state.value)],
    )


def _axis_status(axis: AxisReport) -> DiagnosticStatus:
    figures = {
        'active': str(axis.active),
        'lowest': f'{axis.lowest:.6f}',
        'highest': f'{axis.highest:.6f}',
        'error_max': f'{axis.error_max:.6f}',
        'error_rms': f'{axis.error_rms:.6f}',
        'samples': str(axis.samples),
    }
    return DiagnosticStatus(
        level=DiagnosticStatus.OK,
        name=f'wave: {axis.name}',
        message='in the wave' if axis.active else f'not in the wave: {axis.left or "idle"}',
        values=[KeyValue(key=key, value=value) for key, value in figures.items()],
    )
