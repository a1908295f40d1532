# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Snapshots as /diagnostics messages (REP 107): one status per device, one for the bus."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from canopen_core.can import BusCounters, ControllerState, LoadFigures
from canopen_core.standard import DriveState

from ..cia402.state import DriveStatus
from ..master.frame_sender import ControllerWatch
from ..master.network import Network
from ..master.remote_node import node_status, NodeStatus
from ..master.runner import CycleFigures
from .output_thread import OutputThread

HIGH_LOAD = 0.7  # share of the bus time above which low-priority frames begin to wait long


class DiagnosticsPublisher:
    """Publishes ``diagnostics`` of a bus in the output thread."""

    def __init__(self, node: Node, output: OutputThread) -> None:
        self._node = node
        self._output = output
        self._publisher = node.create_publisher(DiagnosticArray, 'diagnostics', 10)

    def post(self, statuses: list[DiagnosticStatus]) -> None:
        """Queue statuses for publishing; they replace older ones that are still queued."""
        self._output.post_stream('diagnostics', partial(self._publish, statuses))

    def _publish(self, statuses: list[DiagnosticStatus]) -> None:
        message = DiagnosticArray(status=statuses)
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)


def bus_diagnostics(
    master: str,
    bus: str,
    network: Network,
    drives: Mapping[str, Sequence[DriveStatus]],
    now: float,
    *,
    counters: BusCounters,
    load: LoadFigures,
    cycle: CycleFigures,
    recording: Callable[[str], str],
    io: Mapping[str, dict[str, str]] = MappingProxyType({}),
) -> list[DiagnosticStatus]:
    """Return the status of the bus and its cycle, of each non-drive device and each drive axis.

    ``recording`` returns the latest black-box file of a device's fault (of any device for an empty
    name), or an empty text. ``io`` holds values of I/O modules and encoders, by device.
    """
    controller = network.controller
    level, message = _bus_level(controller, counters, load)
    about_bus = DiagnosticStatus(
        level=level,
        name=f'{master}: bus',
        message=message,
        hardware_id=bus,
        values=_values(
            {
                'frames_per_second': f'{load.frames_per_second:.1f}',
                'bus_load': f'{load.load * 100:.2f}',
                'frames_received': str(counters.received),
                'frames_sent': str(counters.sent),
                'frames_lost': str(counters.lost),
                'send_errors': str(counters.send_errors),
                'sync_period': f'{cycle.period:.6f}',
                'cycles': str(cycle.cycles),
                'overruns': str(cycle.overruns),
                'jitter_p50': f'{cycle.jitter_p50:.6f}',
                'jitter_p99': f'{cycle.jitter_p99:.6f}',
                'jitter_max': f'{cycle.jitter_max:.6f}',
                'missed_pdos': str(network.missed_pdos),
                'late_pdos': str(network.late_pdos),
                'unknown_frames': str(network.unknown_frames),
                'controller': controller.state.value,
                'transmit_errors': str(controller.transmit_errors),
                'receive_errors': str(controller.receive_errors),
                'error_frames': str(controller.error_frames),
                'last_error': controller.last_error,
                'black_box': recording(''),
            }
        ),
    )
    statuses = [about_bus]
    for device in network.nodes.values():
        file = recording(device.name)
        if device.name in drives:
            statuses += [drive_diagnostic(bus, axis, file) for axis in drives[device.name]]
        else:
            status, shown = node_status(device, now), io.get(device.name)
            statuses.append(device_diagnostic(bus, status, file, shown))
    return statuses


def device_diagnostic(
    bus: str, status: NodeStatus, recording: str = '', io: dict[str, str] | None = None
) -> DiagnosticStatus:
    """Return the status of a device that is no drive.

    ``recording`` is the latest black-box file of a fault of the device, empty without one; ``io``
    holds the values of an I/O module or encoder.
    """
    io = io or {}
    level, message = _device_level(status)
    if not status.online and 'outputs_on_loss' in io:
        message += f'; its outputs: {io["outputs_on_loss"]}'
    return DiagnosticStatus(
        level=level,
        name=f'{status.name}: device',
        message=message,
        hardware_id=f'{bus}/{status.node_id}',
        values=_values(_device_values(status) | io | {'black_box': recording}),
    )


def drive_diagnostic(bus: str, status: DriveStatus, recording: str = '') -> DiagnosticStatus:
    """Return the status of a drive; arguments as for :func:`device_diagnostic`."""
    level, message = _device_level(status.node)
    if level in (DiagnosticStatus.OK, DiagnosticStatus.WARN):
        message = status.summary
    stale = status.state is not DriveState.UNKNOWN and not status.fresh
    if status.faulted or status.failure or stale:
        level = DiagnosticStatus.ERROR
    elif level == DiagnosticStatus.OK and status.warning:
        level = DiagnosticStatus.WARN
    unknown = status.state is DriveState.UNKNOWN
    return DiagnosticStatus(
        level=level,
        name=f'{status.name}: drive',
        message=message,
        hardware_id=f'{bus}/{status.node.node_id}',
        values=_values(
            _device_values(status.node)
            | {
                'state': status.state.title,
                'mode': '' if unknown else status.mode,
                'statusword': '' if unknown else status.statusword,
                'state_age': f'{status.age:.3f}',
                'error_code': status.error,
                'position': f'{status.position:.6f}',
                'velocity': f'{status.velocity:.6f}',
                'setpoint': f'{status.setpoint:.6f}',
                'following_error': f'{status.following_error:.6f}',
                'black_box': recording,
            }
        ),
    )


def _bus_level(
    controller: ControllerWatch, counters: BusCounters, load: LoadFigures
) -> tuple[bytes, str]:
    state = f'{controller.state.value}: {controller.last_error}'
    if controller.state in {ControllerState.BUS_OFF, ControllerState.PASSIVE}:
        return DiagnosticStatus.ERROR, state
    if controller.state is ControllerState.WARNING:
        return DiagnosticStatus.WARN, state
    if counters.lost or counters.send_errors:
        text = f'{counters.lost} frames lost, {counters.send_errors} not sent since the start'
        return DiagnosticStatus.WARN, text
    if load.load > HIGH_LOAD:
        return DiagnosticStatus.WARN, f'bus load {load.load:.0%}'
    return DiagnosticStatus.OK, f'{load.frames_per_second:.0f} frames/s'


def _device_level(status: NodeStatus) -> tuple[bytes, str]:
    if not status.online:
        detail = f': {status.phase_detail}' if status.phase_detail else ''
        return DiagnosticStatus.ERROR, f'offline, {status.phase.value}{detail}'
    if status.emergency is not None:
        return DiagnosticStatus.ERROR, f'EMCY {status.emergency}'
    if status.left_operational and status.nmt_state is not None:
        return DiagnosticStatus.WARN, f'NMT state {status.nmt_state.name}: start it by NMT'
    return DiagnosticStatus.OK, status.phase.value


def _device_values(status: NodeStatus) -> dict[str, str]:
    return {
        'online': str(status.online),
        'nmt_state': status.nmt_state.name if status.nmt_state is not None else 'OFFLINE',
        'boot_phase': f'{status.phase.value} {status.phase_detail}'.strip(),
        'heartbeat_age': '' if status.heartbeat_age is None else f'{status.heartbeat_age:.3f}',
        'emergency': '' if status.emergency is None else str(status.emergency),
        'emergencies': '; '.join(status.emergencies),
        'missed_pdos': str(status.missed_pdos),
        'sdo_done': str(status.sdo.done),
        'sdo_aborted': str(status.sdo.aborted),
        'sdo_timed_out': str(status.sdo.timed_out),
        'sdo_repeated': str(status.sdo.repeated),
    }


def _values(values: dict[str, str]) -> list[KeyValue]:
    return [KeyValue(key=key, value=value) for key, value in values.items()]
