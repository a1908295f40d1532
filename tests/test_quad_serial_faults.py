# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The serial line fails while the quadruped walks: it says why, nothing jumps, it walks again."""

from __future__ import annotations

from collections.abc import Iterator
import math
import re
import signal
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point
from isolation import reserve
import pytest
from simulated_quad import LEANING, SimulatedQuad, STALLS

from quad_description import Pose, pose_positions
from quad_msgs.srv import InjectFault

pytestmark = pytest.mark.scenario

LARGEST_STEP = math.radians(23.0)
"""Radians between two targets of a servo; the trot needs half of it, a jump would be more."""
WALKED = 0.15
"""How far it goes when it walks in [m]."""
TRIES = 20
"""How often it walks for 0.5 s until it is so far; three are enough where nothing stalls."""
DURATION = 2.0
"""How long a fault goes on in [s]."""


@pytest.fixture(scope='module')
def processes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimulatedQuad]:
    """Start a quadruped for all tests of this module: each leaves it walking again."""
    folder = tmp_path_factory.mktemp('quad')
    with reserve() as isolation, SimulatedQuad(isolation, folder, tapped=False) as quad:
        yield quad


@pytest.fixture
def quad(processes: SimulatedQuad) -> SimulatedQuad:
    """Let it walk, if the test before has not left it so."""
    if processes.state != 'walk':
        processes.start_ended()  # after a test that has failed
        walk_again(processes)
    return processes


def walk_again(quad: SimulatedQuad) -> None:
    """Clear the fault, if there is one, stand up and walk; nothing has ended meanwhile."""
    for name, process in quad.processes.items():
        assert process.is_running(), f'{name} has ended'
    place = quad.truth[-1].pose.pose.position
    tries = 0
    while quad.state != 'walk' or far_from(quad, place) < WALKED:
        if quad.state != 'walk':
            assert not tries or quad.state != 'fault' or quad.stalled, quad.state
            quad.clear_fault()
            quad.stand()
            quad.set_mode('walk')
            place = quad.truth[-1].pose.pose.position
        quad.walk(0.5)
        tries += 1
        assert tries < TRIES, far_from(quad, place)


def far_from(quad: SimulatedQuad, place: Point) -> float:
    """Return how far the body is from a place on the ground in [m]."""
    now = quad.truth[-1].pose.pose.position
    return math.hypot(now.x - place.x, now.y - place.y)


def inject(quad: SimulatedQuad, fault: str, *settings: str) -> None:
    """Let the robot misbehave for a while, and walk on in the meantime."""
    request = InjectFault.Request(fault=fault, settings=settings, duration=DURATION)
    answer = quad.client.call(InjectFault, '/fake_xgo/fault', request)
    assert answer.success, answer.message
    quad.walk(DURATION + 0.5)


def largest_step(messages: list[Any]) -> float:
    """Return the largest step of a servo target that the bridge has sent in [rad]."""
    statuses = [status for message in messages for status in message.status]
    values = [value for status in statuses for value in status.values]
    return max(float(value.value) for value in values if value.key == 'largest_step')


STOPPED = ('controller', 'fault, .*joint states')
"""The controller stops the robot by itself, and says why."""

GONE = 'connecting: .* was hung up'
"""What the bridge says of a port that has vanished."""

HELD = ('controller', 'fault, .*(joint states|attitude|imu)|joint states are .* ms old; holding')
"""It holds the legs until a report comes through, or stops when that takes too long."""


@pytest.mark.parametrize(
    ('fault', 'settings', 'reasons'),
    [
        ('unplug', [], [('hardware', 'stale|connecting'), STOPPED]),
        ('brown_out', [], [('hardware', 'stale')]),
        ('flip', ['rate=0.01'], [HELD]),
    ],
    ids=['unplugged', 'without power', 'corrupt'],
)
def test_a_broken_line_is_reported_and_survived(
    quad: SimulatedQuad, fault: str, settings: list[str], reasons: list[tuple[str, str]]
) -> None:
    """No jump, and walking again when the line is good again.

    It does not fall, but leans: while reports are missing, be it for all of the fault or, of a
    corrupt or lossy line, between two that come through, the legs are held in mid-trot.
    """
    diagnostics = quad.client.listen(DiagnosticArray, '/diagnostics')
    for _ in range(STALLS):
        counts = [said(quad, speaker, reason) for speaker, reason in reasons]
        inject(quad, fault, *settings)
        if not quad.stalled:  # else the controller had stopped it before the fault could
            break
        walk_again(quad)
    for count, (speaker, reason) in zip(counts, reasons, strict=True):
        quad.processes[speaker].wait_for(reason, count=count + 1)
    if fault != 'brown_out':  # servos without torque do not hold the body
        assert quad.tilt < LEANING
    walk_again(quad)
    assert largest_step(diagnostics) < LARGEST_STEP


def said(quad: SimulatedQuad, speaker: str, reason: str) -> int:
    """Return how often a process has given a reason so far."""
    return sum(bool(re.search(reason, line)) for line in quad.processes[speaker].lines)


def test_a_robot_that_is_killed_is_named_and_its_successor_walks(quad: SimulatedQuad) -> None:
    """Its terminal is gone without a word; the one that comes lies until it is asked."""
    diagnostics = quad.client.listen(DiagnosticArray, '/diagnostics')
    bridge, controller = quad.processes['hardware'], quad.processes['controller']
    count = said(quad, 'hardware', GONE), said(quad, 'controller', STOPPED[1])
    quad.walk(0.5)
    quad.processes['fake_xgo'].signal(signal.SIGKILL)
    bridge.wait_for(GONE, count=count[0] + 1)
    controller.wait_for(STOPPED[1], count=count[1] + 1)
    running = said(quad, 'hardware', 'running: ')
    killed = time.time()
    quad.start('fake_xgo')
    bridge.wait_for('running: ', count=running + 1)
    # what the one that was killed said last may still be on its way
    quad.client.spin_until(lambda: quad.truth[-1].header.stamp.sec > killed, 20.0, 'its place')
    quad.spin(1.0)
    lying = pose_positions(Pose.LIE)
    places = dict(zip(quad.joints[-1].name, quad.joints[-1].position, strict=True))
    assert {name: places[name] for name in lying} == pytest.approx(lying, abs=0.05)
    walk_again(quad)
    assert largest_step(diagnostics) < LARGEST_STEP
