# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Snapshots as /diagnostics messages (REP 107): one status per device, one for the bus."""

from __future__ import annotations

from dataclasses import dataclass

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from ..can.bus import BusCounters
from ..can.error_frames import ControllerState
from ..can.load import LoadFigures
from ..cia402.status import DriveStatus
from ..master.network import Network
from ..master.statistics import CycleFigures
from ..master.status import NodeStatus
from ..standard.drive import DriveState

HIGH_LOAD = 0.7  # share of the bus time above which low-priority frames begin to wait long


@dataclass(frozen=True, slots=True)
class BusStatus:
    """How the bus was at one moment.

    Attributes:
        name: Name of the CAN interface.
        counters: Frames so far.
        load: Frames per second and load.
        cycle: Figures of the SYNC cycle.
        missed_pdos: TPDOs that did not answer a SYNC, over all devices.
        late_pdos: TPDOs that came after the synchronous window.
        unknown_frames: Frames with an identifier that nobody on this bus should use.
        controller: State of the CAN controller.
        transmit_errors: Its transmit error counter.
        receive_errors: Its receive error counter.
        error_frames: Number of its error frames.
        last_error: The last of them in words.
        recording: Last file of the black box; empty before one.
    """

    name: str
    counters: BusCounters
    load: LoadFigures
    cycle: CycleFigures
    missed_pdos: int
    late_pdos: int = 0
    unknown_frames: int = 0
    controller: ControllerState = ControllerState.ACTIVE
    transmit_errors: int = 0
    receive_errors: int = 0
    error_frames: int = 0
    last_error: str = ''
    recording: str = ''


def bus_status(
    name: str,
    counters: BusCounters,
    load: LoadFigures,
    cycle: CycleFigures,
    *,
    network: Network,
    recording: str,
) -> BusStatus:
    """Take a snapshot of a bus.

    Args:
        name: Name of the CAN interface.
        counters: Frames so far.
        load: Frames per second and load.
        cycle: Figures of the SYNC cycle.
        network: Its devices.
        recording: Last file of the black box; empty before one.
    """
    controller = network.controller
    return BusStatus(
        name,
        counters,
        load,
        cycle,
        network.missed_pdos,
        network.late_pdos,
        network.unknown_frames,
        controller.state,
        controller.transmit_errors,
        controller.receive_errors,
        controller.error_frames,
        controller.last_error,
        recording,
    )


def device_diagnostic(bus: str, status: NodeStatus, recording: str = '') -> DiagnosticStatus:
    """Describe a device that is no drive.

    Args:
        bus: Name of the CAN interface.
        status: The device.
        recording: Last file of the black box with a fault of it; empty before one.
    """
    level, message = _device_level(status)
    return DiagnosticStatus(
        level=level,
        name=f'{status.name}: device',
        message=message,
        hardware_id=f'{bus}/{status.node_id}',
        values=_values(_device_values(status) | {'black_box': recording}),
    )


def drive_diagnostic(bus: str, status: DriveStatus, recording: str = '') -> DiagnosticStatus:
    """Describe a drive; arguments as of :func:`device_diagnostic`."""
    level, message = _device_level(status.node)
    if level == DiagnosticStatus.OK:
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


def bus_diagnostic(master: str, status: BusStatus) -> DiagnosticStatus:
    """Describe the bus and its cycle."""
    counters, cycle = status.counters, status.cycle
    level, message = _bus_level(status)
    return DiagnosticStatus(
        level=level,
        name=f'{master}: bus',
        message=message,
        hardware_id=status.name,
        values=_values(
            {
                'frames_per_second': f'{status.load.frames_per_second:.1f}',
                'bus_load': f'{status.load.load * 100:.2f}',
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
                'missed_pdos': str(status.missed_pdos),
                'late_pdos': str(status.late_pdos),
                'unknown_frames': str(status.unknown_frames),
                'controller': status.controller.value,
                'transmit_errors': str(status.transmit_errors),
                'receive_errors': str(status.receive_errors),
                'error_frames': str(status.error_frames),
                'last_error': status.last_error,
                'black_box': status.recording,
            }
        ),
    )


def _bus_level(status: BusStatus) -> tuple[bytes, str]:
    counters = status.counters
    if status.controller in {ControllerState.BUS_OFF, ControllerState.PASSIVE}:
        return DiagnosticStatus.ERROR, f'{status.controller.value}: {status.last_error}'
    if status.controller is ControllerState.WARNING:
        return DiagnosticStatus.WARN, f'{status.controller.value}: {status.last_error}'
    if counters.lost or counters.send_errors:
        text = f'{counters.lost} frames lost, {counters.send_errors} not sent since the start'
        return DiagnosticStatus.WARN, text
    if status.load.load > HIGH_LOAD:
        return DiagnosticStatus.WARN, f'bus load {status.load.load:.0%}'
    return DiagnosticStatus.OK, f'{status.load.frames_per_second:.0f} frames/s'


def _device_level(status: NodeStatus) -> tuple[bytes, str]:
    if not status.online:
        detail = f': {status.phase_detail}' if status.phase_detail else ''
        return DiagnosticStatus.ERROR, f'offline, {status.phase.value}{detail}'
    if status.emergency is not None:
        return DiagnosticStatus.ERROR, f'EMCY {status.emergency}'
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
