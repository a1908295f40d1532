# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The driver through a library with the vendor's public names, to a robot of protocol v2."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import threading
from types import SimpleNamespace

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from xgo_lib2 import feedback

from quad_hardware import CommandError, LinkError
from quad_hardware.link import Driver, LinkOptions, LinkState
from quad_hardware.link.open import open_session
from quad_hardware.nodes import parameters
from quad_hardware.protocol import LEG_MOTORS, V2
from quad_hardware.report import Report
from quad_pty_peer import PtyPeer

TIMEOUT = 15.0  # [s]
METHOD = 'write_servo_angle'  # of our stand-in; what the vendor calls it is not public


@pytest.fixture
def peer(tmp_path: Path) -> Iterator[PtyPeer]:
    """A robot of protocol v2."""
    with PtyPeer(tmp_path / 'port') as peer:
        yield peer


@pytest.mark.parametrize('acceleration', [True, False])
def test_the_library_does_the_talking(
    peer: PtyPeer, monkeypatch: pytest.MonkeyPatch, *, acceleration: bool
) -> None:
    """States by its parser and slots, angles by its method: what the robot receives is right."""
    if not acceleration:  # which is no public name
        whole = feedback.device_state
        names = ('battery', 'roll', 'pitch', 'yaw', 'joint_pos_deg', 'joint_vel_deg_s')
        monkeypatch.setattr(
            feedback,
            'device_state',
            lambda sample: SimpleNamespace(**{n: getattr(whole(sample), n) for n in names}),
        )
    peer.behaviour.attitude = (1.0, 2.0, 3.0)
    peer.angles.update({motor: float(motor) for motor in peer.angles})
    before = dict(peer.angles)
    states: list[Report] = []
    commanded = threading.Event()

    def take(state: Report) -> str:
        states.append(state)
        if state.positions[43] == pytest.approx(12.5):
            commanded.set()
        elif len(states) > 2:
            driver.command(dict.fromkeys(LEG_MOTORS, 12.5))
        return ''

    options = LinkOptions(str(peer.link), (), vendor=True, vendor_method=METHOD)
    driver = Driver(options, take, lambda *_: None)
    driver.start()
    assert commanded.wait(TIMEOUT), driver.status()
    assert not driver.torque(on=False)
    status = driver.status()
    driver.stop()
    assert (status.protocol, status.state) == ('vendor', LinkState.RUNNING)
    assert states[0].attitude == (1.0, 2.0, 3.0)
    assert states[0].positions == before
    assert {motor: peer.angles[motor] for motor in LEG_MOTORS} == dict.fromkeys(LEG_MOTORS, 12.5)
    assert (states[0].acceleration is not None) is acceleration
    assert peer.torque


@pytest.mark.parametrize('method', ['', 'spin', '_send'])
def test_a_method_that_is_not_there_is_refused(peer: PtyPeer, method: str) -> None:
    """The message names the parameter, and the methods that there are; nothing is guessed."""
    with pytest.raises(LinkError, match=f'vendor_servo_method.*{METHOD}'):
        open_session(LinkOptions(str(peer.link), (), vendor=True, vendor_method=method))
    assert peer.commands == []


def test_no_other_way_is_tried(tmp_path: Path) -> None:
    """Where the library finds no robot, nobody else looks for one."""
    options = LinkOptions(str(tmp_path / 'none'), (V2,), vendor=True, vendor_method=METHOD)
    with pytest.raises(LinkError, match='xgo_lib2 cannot open'):
        open_session(options)


def declare(*overrides: str) -> LinkOptions:
    """Declare the parameters of hardware_node with some of them set."""
    context = Context()
    words = [word for override in overrides for word in ('-p', override)]
    rclpy.init(args=['--ros-args', *words], context=context)
    node = Node('hardware_node', context=context, enable_rosout=False)
    try:
        return parameters.declare_parameters(node).robot.link
    finally:
        node.destroy_node()  # type: ignore[no-untyped-call]
        rclpy.shutdown(context=context)


@pytest.mark.parametrize(
    ('installed', 'overrides', 'named'),
    [
        (True, (), 'set protocol'),
        (True, ('protocol:=vendor',), 'vendor_servo_method'),
        (False, ('protocol:=vendor', f'vendor_servo_method:={METHOD}'), 'protocol'),
    ],
)
def test_what_would_have_to_be_guessed_is_refused(
    monkeypatch: pytest.MonkeyPatch, *, installed: bool, overrides: tuple[str, ...], named: str
) -> None:
    """Before the port is opened, and the message names the parameter."""
    monkeypatch.setattr(parameters, 'is_installed', lambda: installed)
    with pytest.raises(CommandError, match=named):
        declare(*overrides)


@pytest.mark.parametrize(
    ('installed', 'overrides', 'vendor'),
    [
        (False, (), False),
        (True, ('protocol:=v2',), False),
        (True, ('protocol:=v1',), False),
        (True, ('protocol:=vendor', f'vendor_servo_method:={METHOD}'), True),
    ],
)
def test_what_is_said_is_done(
    monkeypatch: pytest.MonkeyPatch, *, installed: bool, overrides: tuple[str, ...], vendor: bool
) -> None:
    """Through the library when it was chosen, and without it otherwise."""
    monkeypatch.setattr(parameters, 'is_installed', lambda: installed)
    assert declare(*overrides).vendor is vendor
