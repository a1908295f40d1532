# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Devices that leave Operational by themselves, and devices that never report their NMT state."""

from __future__ import annotations

from dataclasses import dataclass, replace
import itertools

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config
import pytest
from scripted_device import object_bytes, ScriptedDevice, START
from test_master_boot import DEVICE_VALUES, io_config, NODE, NODE_ID

from arm_canopen import EventKind
from arm_canopen.can import Frame
from arm_canopen.master.remote_node import DropBackoff, LONGEST_PAUSE, STABLE_TIME
from arm_canopen.standard import NmtCommand, NmtState

OPERATING_TIME = 0.15  # [s] before it falls back
EMCY = bytes((0x30, 0x81, 0x11, 0, 0, 0, 0, 0))  # 0x8130: life guard or heartbeat error


@dataclass
class Relapsing(ScriptedDevice):
    """A device that falls back to Pre-operational soon after each start.

    Attributes:
        reports_why: It sends an EMCY before.
        relapses: It does so.
    """

    reports_why: bool = True
    relapses: bool = True
    _falls_at: float | None = None

    def receive(self, frame: Frame, now: float) -> None:
        """Note when it was started."""
        super().receive(frame, now)
        started = frame.can_id == 0 and frame.data[0] == START
        if started and frame.data[1] in (0, self.node_id) and self.relapses:
            self._falls_at = now + OPERATING_TIME

    def advance(self, now: float) -> None:
        """Fall back."""
        super().advance(now)
        if self._falls_at is not None and self._falls_at <= now:
            self._falls_at = None
            self.state = NmtState.PRE_OPERATIONAL
            if self.reports_why:
                self.send(Frame(0x80 + self.node_id, EMCY))

    def next_deadline(self) -> float | None:
        """Return when it wants to act in [s]."""
        dues = [super().next_deadline(), self._falls_at]
        return min((due for due in dues if due is not None), default=None)


def relapsing(**changes: bool) -> tuple[VirtualNetwork, Relapsing]:
    """Start a master with such a device."""
    net = VirtualNetwork(bus_config(io_config()), absent=[NODE])
    device = Relapsing(
        NODE_ID,
        lambda frame: net.send_as(NODE, frame),
        object_bytes(DEVICE_VALUES),
        **changes,  # type: ignore[arg-type]
    )
    net.connect(NODE, device)
    net.start()
    return net, device


def starts(net: VirtualNetwork) -> list[float]:
    """Return when the device was started in [s]."""
    data = bytes((NmtCommand.START, NODE_ID))
    return [
        sent.time for sent in net.wire.log if sent.frame.can_id == 0 and sent.frame.data == data
    ]


def losses(net: VirtualNetwork) -> list[str]:
    """Return what was reported of its drops."""
    return [event.text for event in net.events if event.kind is EventKind.HEARTBEAT_LOST]


def test_a_device_that_falls_back_is_left_alone_longer_and_longer() -> None:
    """The pauses double up to half a minute: 9 boots in 2 minutes, not 130."""
    net, _ = relapsing()
    net.run(120.0)
    times = starts(net)
    pauses = [later - time for time, later in itertools.pairwise(times)]
    assert all(later > 1.5 * pause for pause, later in itertools.pairwise(pauses[:5]))
    assert max(pauses) < LONGEST_PAUSE + 1.0
    assert len(times) < 10


def test_the_reason_is_its_emcy() -> None:
    """Each drop names the EMCY, and when the device is booted again; so does the boot phase."""
    net, _ = relapsing()
    net.run(3.0)
    reported = losses(net)
    assert len(reported) >= 2
    assert all('0x8130' in text for text in reported)
    node = net.network.nodes[NODE]
    net.run_until(lambda: not node.online, 60.0)
    assert '0x8130' in node.phase_text


def test_a_drop_without_emcy_says_so() -> None:
    """Then the likely causes are named."""
    net, _ = relapsing(reports_why=False)
    net.run(1.0)
    assert 'no EMCY' in losses(net)[0]


def test_a_device_that_stays_is_forgiven() -> None:
    """After some time in operation the next drop is the first one again."""
    net, device = relapsing()
    net.run(10.0)
    device.relapses = False
    net.run(40.0 + STABLE_TIME)
    assert net.network.nodes[NODE].online
    device.state = NmtState.PRE_OPERATIONAL
    begin = net.now
    net.run_until(lambda: len([time for time in starts(net) if time > begin]) == 1, 3.0)


def test_the_pauses() -> None:
    """0.5 s, doubled with each drop that follows soon."""
    backoff, now, pauses = DropBackoff(), 0.0, []
    for _ in range(9):
        backoff.booted(now)
        pauses.append(backoff.dropped(now + 1.0))
        now += 40.0
    assert pauses == [0.5, 1, 2, 4, 8, 16, 30, 30, 30]
    backoff.booted(now)
    assert backoff.dropped(now + STABLE_TIME + 1.0) == 0.5


@pytest.fixture
def mute() -> VirtualNetwork:
    """A booted device without heartbeat and node guarding."""
    config = replace(drive_config(NODE, NODE_ID), heartbeat_producer=0.0, heartbeat_timeout=0.0)
    net = VirtualNetwork(bus_config(config))
    net.boot()
    return net


def state(net: VirtualNetwork) -> NmtState | None:
    """Return the NMT state of the device as the master takes it to be."""
    return net.network.nodes[NODE].nmt_state


def test_a_device_that_never_reports_its_state_is_in_the_commanded_one(
    mute: VirtualNetwork,
) -> None:
    """Operational after its boot, and what somebody commands afterwards."""
    node = mute.network.nodes[NODE]
    assert state(mute) is NmtState.OPERATIONAL
    mute.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, NODE_ID)
    assert state(mute) is NmtState.PRE_OPERATIONAL
    assert node.left_operational
    mute.network.send_nmt(NmtCommand.START, NODE_ID)
    assert state(mute) is NmtState.OPERATIONAL
    assert node.operational


def test_it_is_operational_again_after_a_restart(mute: VirtualNetwork) -> None:
    """Its boot-up message is the only sign of life that it gives."""
    node = mute.network.nodes[NODE]
    mute.power_off(NODE)
    mute.power_on(NODE)
    mute.run(0.01)
    assert state(mute) is not NmtState.OPERATIONAL
    mute.run_until(lambda: node.online)
    assert state(mute) is NmtState.OPERATIONAL
    states = [event.text for event in mute.events if event.kind is EventKind.NMT_STATE]
    assert states[-1] == 'NMT state OPERATIONAL'
