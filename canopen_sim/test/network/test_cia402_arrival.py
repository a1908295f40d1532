# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A motion that is waited for: it arrives, or its caller gets an error that it was replaced."""

from __future__ import annotations

from collections.abc import Sequence

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, SCALE
import pytest

from arm_canopen import AxisFeedback, DriveError, OperationMode, Refusal
from arm_canopen.cia402.position_modes import Move
from arm_canopen.master.scheduler import Promise
from canopen_sim import ServoModel

pytestmark = pytest.mark.slow

JOINT = 'joint1'
LAG = 0.05  # [s] of a motor that comes after its set-points
MODES = pytest.mark.parametrize(
    'mode',
    [
        OperationMode.PROFILE_POSITION,
        OperationMode.INTERPOLATED_POSITION,
        OperationMode.CYCLIC_POSITION,
    ],
    ids=lambda mode: mode.name,
)


class Client:
    """Callers that wait for motions of one drive."""

    def __init__(self, mode: OperationMode, servo: ServoModel | None = None) -> None:
        """Enable the drive in a mode."""
        self.net = VirtualNetwork(bus_config(drive_config(JOINT, 2)), servo=servo)
        self.net.boot()
        self.net.do(JOINT, 'init')
        self.net.select(JOINT, mode)
        self.mode = mode

    def move_to(self, position: float, timeout: float = 20.0) -> Promise[str]:
        """Begin to wait for a motion."""
        commands = self.net.commands[JOINT]

        def give() -> str:
            if self.mode is OperationMode.PROFILE_POSITION:
                return commands.move(Move(position))
            return commands.set_target(position)

        return self.net.network.scheduler.spawn(commands.arrive(give, timeout))

    @property
    def motor(self) -> float:
        """Where the motor is in [rad]."""
        drive = self.net.devices[JOINT].drive
        assert drive is not None
        return drive.position / SCALE


@MODES
def test_a_motion_ends_where_its_target_is(mode: OperationMode) -> None:
    """One after the other, there and back."""
    client = Client(mode)
    for position in (0.3, 0.0, 0.3):
        client.net.result(client.move_to(position))
        assert client.motor == pytest.approx(position, abs=0.01)


@MODES
def test_a_motion_that_is_replaced_fails_and_the_other_one_arrives(mode: OperationMode) -> None:
    """Its caller learns it at once, and not that it has arrived somewhere."""
    client = Client(mode)
    first = client.move_to(1.5)
    client.net.run(0.3)
    second = client.move_to(0.0)
    with pytest.raises(DriveError, match='got another target'):
        client.net.result(first, timeout=0.1)
    client.net.result(second)
    assert client.motor == pytest.approx(0.0, abs=0.01)


@MODES
def test_the_time_out_of_a_replaced_motion_halts_nobody(mode: OperationMode) -> None:
    """It would be the motion of another caller."""
    client = Client(mode)
    first = client.move_to(1.5, timeout=0.5)
    client.net.run(0.3)
    second = client.move_to(-1.5)
    client.net.run(1.0)
    with pytest.raises(DriveError, match='got another target'):
        first.result()
    client.net.result(second)
    assert client.motor == pytest.approx(-1.5, abs=0.01)


class Onwards:
    """A motion source that goes on wherever it may."""

    axes = (JOINT,)

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> list[float | None]:
        """Lead the axis up while it follows."""
        axis = feedback[0]
        return [axis.setpoint + 0.3 * period if axis.followable else None]

    def released(self, axis: str, refusal: Refusal) -> None:
        """Lose it."""


def test_a_motion_source_that_takes_the_drive_replaces_a_motion() -> None:
    """Right after its profile has ended, when the motor is not there yet."""
    client = Client(OperationMode.CYCLIC_POSITION, ServoModel(lag=LAG))
    motion = client.move_to(0.3)
    drive = client.net.drives[JOINT]
    client.net.run_until(lambda: drive.control.stream_refusal is None)
    client.net.master.attach(Onwards())
    with pytest.raises(DriveError, match='got another target'):
        client.net.result(motion)
