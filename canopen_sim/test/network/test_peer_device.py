# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A device by others: our master boots, configures and reads a LocalNode of python-canopen.

A LocalNode answers SDOs, executes NMT commands and sends heartbeats; it has no boot-up after a
reset and sends no PDOs by itself (python-canopen says so), hence the test goes as far as it does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from bus_rig import VirtualNetwork
import can
import canopen
from drive_samples import bus_config, drive_config, DRIVE_EDS

from arm_canopen import NodeConfig
from canopen_core.can import Frame

NODE_ID = 2
NAME = 'stranger'
NEVER = float('inf')


@dataclass
class Heartbeat:
    """A message that python-canopen wants to be sent again and again."""

    frame: Frame  # the message
    period: float  # time between two in [s]
    due: float  # when the next one is due in [s]

    def stop(self) -> None:
        """Send no more."""
        self.due = NEVER

    def modify_data(self, message: can.Message) -> None:
        """Send something else from now on."""
        self.frame = as_frame(message)


def as_frame(message: can.Message) -> Frame:
    """Return our frame for a message of python-can."""
    return Frame(message.arbitration_id, bytes(message.data))


class Stranger:
    """A LocalNode of python-canopen as a station of the virtual network, and its bus."""

    def __init__(self, network: VirtualNetwork) -> None:
        """Connect it."""
        self._network = network
        self._periodic: list[Heartbeat] = []
        make_network: Any = canopen.Network  # python-canopen has no types
        self._others = make_network()
        self._others.bus = self
        self.node: Any = canopen.LocalNode(NODE_ID, str(DRIVE_EDS))
        self._others.add_node(self.node)
        network.connect(NAME, self)

    def send(self, message: can.Message, timeout: float | None = None) -> None:
        """Send for python-canopen."""
        del timeout
        self._network.send_as(NAME, as_frame(message))

    def send_periodic(self, message: can.Message, period: float, **_: object) -> Heartbeat:
        """Send again and again for python-canopen."""
        task = Heartbeat(as_frame(message), period, self._network.now + period)
        self._periodic.append(task)
        return task

    def receive(self, frame: Frame, now: float) -> None:
        """Hand a frame to python-canopen."""
        if not frame.is_remote:
            self._others.notify(frame.can_id, bytearray(frame.data), now)

    def next_deadline(self) -> float | None:
        """Return when a heartbeat is due."""
        return min((task.due for task in self._periodic if task.due < NEVER), default=None)

    def advance(self, now: float) -> None:
        """Send what is due."""
        for task in self._periodic:
            if task.due <= now:
                task.due += task.period
                self._network.send_as(NAME, task.frame)


def config() -> NodeConfig:
    """Return the stranger as our drive configuration has it."""
    return drive_config(NAME, NODE_ID)


def test_master_boots_a_local_node_of_python_canopen() -> None:
    """Identity, configuration by SDO, heartbeat supervision and start go with a stranger."""
    network = VirtualNetwork(bus_config(config()), absent=[NAME])
    stranger = Stranger(network)
    network.start()
    remote = network.network.nodes[NAME]
    network.run_until(lambda: remote.online, 20.0)
    network.run_until(lambda: stranger.node.nmt.state == 'OPERATIONAL')
    assert stranger.node.sdo[0x1017].raw == 100
    assert stranger.node.sdo[0x6081].raw == 10_000
    assert stranger.node.sdo[0x1A00][0].raw == 2
    network.run(2.0)
    assert remote.online, network.story()
