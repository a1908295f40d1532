# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A client of protocol v1 written from the public description of its bytes.

It shares nothing with the product: no table, no codec, no parser. Its habits are those of the
vendor's library: zero is encoded as 127, servos are written one frame at a time, an answer is read
byte by byte without looking at its kind or address.
"""

from __future__ import annotations

import struct
import time

import serial

SPEED_RANGES = {0x30: 25.0, 0x31: 18.0, 0x32: 100.0}
GAP = 0.001  # [s] the vendor's advice


class V1Client:
    """What a program of somebody else does with the robot."""

    def __init__(self, path: str) -> None:
        """Open the port as the vendor's library does."""
        self.port = serial.Serial(path, 115200, timeout=1.0)

    def close(self) -> None:
        """Close the port."""
        self.port.close()

    def write(self, address: int, data: bytes) -> None:
        """Send a write."""
        length = 8 + len(data)
        check = 255 - (length + 0x00 + address + sum(data)) % 256
        frame = b'\x55\x00' + bytes([length, 0x00, address]) + data + bytes([check]) + b'\x00\xaa'
        self.port.write(frame)
        time.sleep(len(frame) * 10 / 115200 + GAP)

    def read(self, address: int, count: int) -> bytes:
        """Ask for bytes and return the data of the answer, empty without one."""
        check = 255 - (9 + 0x02 + address + count) % 256
        self.port.write(bytes([0x55, 0x00, 9, 0x02, address, count, check, 0x00, 0xAA]))
        if self.port.read_until(b'\x55\x00')[-2:] != b'\x55\x00':
            return b''
        length = self.port.read(1)[0]
        rest: bytes = self.port.read(length - 3)
        body = bytes([length]) + rest[:-3]
        assert rest[-2:] == b'\x00\xaa'
        assert (sum(body) + rest[-3]) % 256 == 255
        return rest[2:-3]

    def move(self, address: int, speed: float) -> None:
        """Walk or turn; zero becomes 127."""
        limit = SPEED_RANGES[address]
        self.write(
            address, bytes([int((min(max(speed, -limit), limit) + limit) / 2 / limit * 255)])
        )

    def firmware(self) -> str:
        """Read the version."""
        return self.read(0x07, 10).decode('ascii').rstrip('\0')

    def battery(self) -> int:
        """Read the charge [%]."""
        return self.read(0x01, 1)[0]

    def attitude(self) -> tuple[float, ...]:
        """Read roll, pitch and yaw one after the other [deg]."""
        return tuple(
            float(struct.unpack('<f', self.read(code, 4))[0]) for code in (0x62, 0x63, 0x64)
        )

    def imu(self) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
        """Read acceleration [m/s2], rate [deg/s] and attitude [deg]."""
        data = self.read(0x65, 24)
        words = struct.unpack('<6h3f', data)
        acceleration = tuple(word / 16384 * 9.8 for word in words[:3])
        return acceleration, tuple(word / 16.4 for word in words[3:6]), words[6:]

    def motors(self) -> bytes:
        """Read 15 servos."""
        return self.read(0x50, 15)
