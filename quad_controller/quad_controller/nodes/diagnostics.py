# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The controller's status as /diagnostics messages (REP 107)."""

from __future__ import annotations

import math

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from ..recording.recorder import Recorder
from ..states.status import Status
from ..timing.pacer import LoopFigures


def state_diagnostic(node: str, status: Status) -> DiagnosticStatus:
    """Describe what the robot does."""
    level, message = DiagnosticStatus.OK, status.title
    if status.faults:
        level, message = DiagnosticStatus.ERROR, '; '.join(status.faults)
    elif math.isinf(status.joints_age):
        words = ('waiting for /joint_states', *status.warnings)
        level, message = DiagnosticStatus.STALE, '; '.join(words)
    elif status.warnings:
        level, message = DiagnosticStatus.WARN, '; '.join(status.warnings)
    velocity = status.velocity
    return DiagnosticStatus(
        level=level,
        name=f'{node}: state',
        message=message,
        values=_values(
            {
                'state': status.title,
                'goal': status.goal.value,
                'gait': status.gait.value,
                'policy': status.policy,
                'velocity': f'{velocity.x:.3f} {velocity.y:.3f} {velocity.yaw:.3f}',
                'joint_states_age': f'{status.joints_age:.3f}',
                'imu_age': f'{status.imu_age:.3f}',
                'battery': '' if status.battery is None else f'{status.battery:.2f}',
                'refused': str(status.refused),
                'targets_slowed': str(status.limited),
                'out_of_reach': str(status.unreachable),
            }
        ),
    )


def loop_diagnostic(node: str, figures: LoopFigures) -> DiagnosticStatus:
    """Describe how well the loop keeps its time."""
    return DiagnosticStatus(
        level=DiagnosticStatus.OK,
        name=f'{node}: loop',
        message=f'{figures.rate:.1f} Hz, jitter p99 {figures.jitter_p99 * 1e3:.2f} ms',
        values=_values(
            {
                'steps': str(figures.steps),
                'overruns': str(figures.overruns),
                'rate': f'{figures.rate:.2f}',
                'jitter_p50': f'{figures.jitter_p50:.6f}',
                'jitter_p99': f'{figures.jitter_p99:.6f}',
                'jitter_max': f'{figures.jitter_max:.6f}',
                'step_p99': f'{figures.duration_p99:.6f}',
                'feedback_to_command_p50': f'{figures.latency_p50:.6f}',
                'feedback_to_command_p99': f'{figures.latency_p99:.6f}',
            }
        ),
    )


def recorder_diagnostic(node: str, recorder: Recorder) -> DiagnosticStatus:
    """Describe how the recording goes."""
    trouble = recorder.failure or (f'{recorder.lost} steps lost' if recorder.lost else '')
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if trouble else DiagnosticStatus.OK,
        name=f'{node}: recorder',
        message=trouble or f'records to {recorder.folder}',
        values=_values({'folder': str(recorder.folder), 'lost': str(recorder.lost)}),
    )


def _values(values: dict[str, str]) -> list[KeyValue]:
    return [KeyValue(key=key, value=value) for key, value in values.items()]
