# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated robot satisfies a client of protocol v1 that shares no code with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import math
from pathlib import Path
import time

import pytest
from sim_serial import serve, Served, TEST_TIMEOUT, V1Client

pytestmark = pytest.mark.slow

# byte = 255 * (angle - low) / (high - low) of the lite's servos: calf, thigh, hip [deg]
RANGES = ((-70.0, 50.0), (-70.0, 90.0), (-30.0, 30.0))


def degrees(data: bytes) -> list[float]:
    """Decode the angles of the leg servos: calf, thigh, hip of each leg."""
    return [
        byte / 255 * (RANGES[k % 3][1] - RANGES[k % 3][0]) + RANGES[k % 3][0]
        for k, byte in enumerate(data[:12])
    ]


def encoded(angles: list[float]) -> bytes:
    """Encode angles of the leg servos."""
    return bytes(
        int(255 * (angle - RANGES[k % 3][0]) / (RANGES[k % 3][1] - RANGES[k % 3][0]))
        for k, angle in enumerate(angles)
    )


def wait(condition: Callable[[], bool], what: str) -> None:
    """Wait until something holds."""
    deadline = time.monotonic() + TEST_TIMEOUT
    while not condition():
        assert time.monotonic() < deadline, f'not: {what}'
        time.sleep(0.01)


@contextmanager
def robot(path: Path, *arguments: str) -> Iterator[tuple[V1Client, Served]]:
    """Give a client of a living robot."""
    with serve(path / 'xgo', '--noise', 'none', *arguments) as served:
        client = V1Client(str(path / 'xgo'))
        try:
            yield client, served
        finally:
            client.close()


def test_golden_bytes(tmp_path: Path) -> None:
    """Frames that are printed in public documents are answered with the printed bytes."""
    arguments = ('--preset', 'mini', '--firmware', 'M-4.3.3', '--battery', '85')
    with robot(tmp_path, '--physics', 'none', *arguments) as (client, _):
        golden = {
            '55 00 09 02 01 01 F2 00 AA': '55 00 09 12 01 55 8E 00 AA',
            '55 00 09 02 07 0A E3 00 AA': '55 00 12 12 07 4D 2D 34 2E 33 2E 33 00 00 00 64 00 AA',
        }
        for request, answer in golden.items():
            client.port.write(bytes.fromhex(request))
            expected = bytes.fromhex(answer)
            assert client.port.read(len(expected)).hex(' ') == expected.hex(' ')
        # 15 servos and the IMU block answer with the lengths of the description
        for request, length in (
            ('55 00 09 02 50 0F 95 00 AA', 23),
            ('55 00 09 02 65 18 77 00 AA', 32),
        ):
            client.port.write(bytes.fromhex(request))
            answer_bytes = client.port.read(length)
            assert len(answer_bytes) == length
            assert answer_bytes[2] == length
            assert answer_bytes[3] == 0x12


def test_what_a_resting_robot_reports(tmp_path: Path) -> None:
    """Firmware, battery, level attitude, one g upwards, and the servos of the standing pose."""
    with robot(tmp_path, '--start', 'stand', '--servo', 'firm') as (client, _):
        assert client.firmware().startswith('L-')
        assert client.battery() == 100
        acceleration, rate, attitude = client.imu()
        assert acceleration == pytest.approx((0, 0, 9.81), abs=0.1)
        assert rate == pytest.approx((0, 0, 0), abs=0.5)
        assert attitude == pytest.approx((0, 0, 0), abs=0.5)
        assert client.attitude() == pytest.approx((0, 0, 0), abs=0.5)
        stand = [math.degrees(q) for q in (-0.2792, 1.0, 0.0)] * 4
        assert degrees(client.motors()) == pytest.approx(stand, abs=1.0)
        assert len(client.read(0x50, 12)) == 12
        assert client.read(0x66, 2) in {b'\x00\x00', b'\xff\xff', b'\x00\x01'}


def test_servos_go_where_one_bulk_frame_sends_them(tmp_path: Path) -> None:
    """Twelve bytes at 0x50 set all legs; reading them back gives the bytes that were written."""
    with robot(tmp_path, '--physics', 'none') as (client, _):
        wanted = encoded([-20.0, 40.0, 5.0, -10.0, 30.0, -5.0, 0.0, 60.0, 10.0, 10.0, 20.0, -10.0])
        client.write(0x50, wanted)
        wait(lambda: client.read(0x50, 12) == wanted, 'the servos arrive')


def test_servos_go_where_single_frames_send_them(tmp_path: Path) -> None:
    """One frame per servo, as the vendor's library sends them, and slower at a lower speed."""
    with robot(tmp_path, '--physics', 'none') as (client, _):
        client.write(0x52, encoded([0, 0, 20.0])[2:])
        wait(lambda: abs(degrees(client.motors())[2] - 20.0) < 0.5, 'servo 13 arrives')
        client.write(0x5C, bytes([10]))
        client.write(0x52, encoded([0, 0, -20.0])[2:])
        first = degrees(client.motors())[2]
        assert first > 0.0
        wait(lambda: abs(degrees(client.motors())[2] + 20.0) < 0.5, 'servo 13 arrives slowly')


def test_motors_without_torque_let_go(tmp_path: Path) -> None:
    """Unload all, load all, and one leg by its number."""
    with robot(tmp_path, '--start', 'stand') as (client, served):
        servos = served.simulation.board.servos
        client.write(0x20, b'\x01')
        wait(lambda: not servos.torque_on(11), 'all unloaded')
        wait(lambda: served.server.truth.pose.position[2] < 0.11, 'the robot sinks')
        client.write(0x20, b'\x00')
        wait(lambda: all(map(servos.torque_on, servos.fitted)), 'all loaded')
        client.write(0x20, b'\x13')
        wait(lambda: not servos.torque_on(31), 'leg 3 unloaded')
        assert [m for m in servos.fitted if not servos.torque_on(m)] == [31, 32, 33]
        client.write(0x20, b'\x23')
        wait(lambda: servos.torque_on(31), 'leg 3 loaded')


def test_the_vendors_zero_is_no_creeping(tmp_path: Path) -> None:
    """A library that encodes zero as 127 commands no motion at all."""
    with robot(tmp_path, '--physics', 'none') as (client, served):
        for register in (0x30, 0x31, 0x32):
            client.move(register, 0.0)
        client.battery()
        assert served.simulation.board.walker.command == (0.0, 0.0, 0.0)


def test_a_pose_of_the_body_and_a_reset(tmp_path: Path) -> None:
    """Pitch and height move the body; action 255 brings the default stance back."""
    with robot(tmp_path, '--start', 'stand') as (client, served):
        client.write(0x37, bytes([255]))
        client.write(0x35, bytes([255]))
        wait(lambda: client.attitude()[1] > 6.0, 'the nose goes down')
        wait(lambda: served.server.truth.pose.position[2] > 0.13, 'the body rises')
        client.write(0x3E, b'\xff')
        wait(lambda: abs(client.attitude()[1]) < 1.0, 'it is level again')
        assert served.simulation.board.walker.stance.attitude == (0.0, 0.0, 0.0)
        client.write(0x3E, b'\x01')
        wait(lambda: degrees(client.motors())[1] > 75.0, 'it folds its legs')


def test_registers_that_cannot_be_read_are_not_answered(tmp_path: Path) -> None:
    """No frame comes back, and the next question is answered."""
    with robot(tmp_path, '--physics', 'none') as (client, _):
        client.port.timeout = 0.1
        assert client.read(0x30, 1) == b''
        assert client.read(0xEE, 1) == b''
        client.port.timeout = 1.0
        assert client.battery() == 100


def test_the_board_loses_frames_that_come_too_fast(tmp_path: Path) -> None:
    """With the option, two frames without a pause are one; with a pause, both are carried out."""
    with robot(tmp_path, '--physics', 'none', '--command-gap', '0.001') as (client, served):
        both = bytes.fromhex('55 00 09 00 30 FF C7 00 AA 55 00 09 00 31 FF C6 00 AA')
        client.port.write(both)
        time.sleep(0.05)
        client.battery()
        ahead, aside, _ = served.simulation.board.walker.command
        assert ahead > 0
        assert aside == 0
        assert served.simulation.line.statistics.hurried == 1
