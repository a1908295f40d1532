# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The states that a robot pushes about 50 times a second."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from quad_hardware import CodecError
from quad_hardware.protocol import (
    Kind,
    ParserCounters,
    ROBOT_KINDS,
    STATE,
    StreamParser,
    V2,
)


@dataclass(frozen=True, slots=True)
class DeviceState:
    """State of a robot, in wire units."""

    battery: int  # charge [%]
    roll: float  # attitude about x [deg]
    pitch: float  # attitude about y [deg]
    yaw: float  # attitude about z [deg]
    # specific force x, y, z [m/s²]; about 9.8 in all at rest
    acceleration: tuple[float, float, float]
    # 16 joint angles [deg], by :func:`xgo_lib2.registry.feedback_slot_of`
    joint_pos_deg: tuple[float, ...]
    joint_vel_deg_s: tuple[float, ...]  # 16 joint velocities [deg/s], in the same order
    device_time_ms: int  # clock of the robot [ms]
    sequence: int  # counts states modulo 2¹⁶


class SendStateParser:
    """Parses states from a byte stream that may be fragmented or damaged."""

    def __init__(self) -> None:
        self._parser = StreamParser(V2, ROBOT_KINDS)

    @property
    def counters(self) -> ParserCounters:
        """Counts of frames, skipped bytes and wrong checksums."""
        return self._parser.counters

    def feed_bytes(self, data: bytes) -> list[DeviceState]:
        """Parse bytes; return the completed states, oldest first."""
        states = []
        for frame in self._parser.feed(data):
            if frame.kind is Kind.PUSH and frame.address == STATE.address:
                try:
                    states.append(device_state(STATE.unpack(frame.payload)))
                except CodecError:
                    continue  # it is cut short
        return states


def device_state(values: Mapping[str, tuple[float, ...]]) -> DeviceState:
    """Convert a state frame to the vendor's field names."""
    (roll, pitch, yaw), (x, y, z) = values['euler2'], values['acceleration']
    return DeviceState(
        battery=int(values['battery'][0]),
        roll=roll,
        pitch=pitch,
        yaw=yaw,
        acceleration=(x, y, z),
        joint_pos_deg=values['position'],
        joint_vel_deg_s=values['velocity'],
        device_time_ms=int(values['device_time'][0]),
        sequence=int(values['sequence'][0]),
    )
