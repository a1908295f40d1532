# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""xgo_lib2: the article's two snippets run as printed, and the vendor's library goes first."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import subprocess
import sys

import pytest
import serial
from xgo_lib2.client import XgoDog
from xgo_lib2.errors import XgoError, XgoNotSupportedError, XgoTimeoutError
from xgo_lib2.feedback import DeviceState, SendStateParser
from xgo_lib2.registry import feedback_slot_of

from quad_hardware.link.open import silence_cause
from quad_hardware.protocol import LEG_MOTORS, V1, V2
from quad_pty_peer import PtyPeer, state_frame

ROOT = Path(__file__).parents[1]

# as in the article, but for the port and for what is printed of each state
CLIENT = """
from xgo_lib2.client import XgoDog

with XgoDog("PORT") as dog:
    print(dog.read_version(), dog.system_read_battery())
    dog.system_set_feedback(1)      # enable ~50 Hz state push
"""
FEEDBACK = """
from xgo_lib2.feedback import SendStateParser

parser = SendStateParser()
for st in parser.feed_bytes(ser.read(4096)):
    st.battery                 # battery %
    st.roll, st.pitch, st.yaw  # attitude (**degrees**)
    st.joint_pos_deg           # 16 joint angles (deg)
    st.joint_vel_deg_s         # 16 joint velocities (deg/s)
"""


@pytest.fixture(params=[V2, V1], ids=lambda protocol: protocol.name)
def peer(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[PtyPeer]:
    """A robot of either protocol."""
    with PtyPeer(tmp_path / 'port', request.param) as peer:
        yield peer


@pytest.fixture
def v2_peer(tmp_path: Path) -> Iterator[PtyPeer]:
    """A robot of protocol v2."""
    with PtyPeer(tmp_path / 'port') as peer:
        yield peer


def test_the_articles_snippets_run_as_printed(
    v2_peer: PtyPeer, capsys: pytest.CaptureFixture[str]
) -> None:
    """Version and battery, states switched on, then 16 angles in each of them."""
    exec(CLIENT.replace('PORT', str(v2_peer.link)), {})  # noqa: S102
    assert capsys.readouterr().out == 'L-2.0.0 80\n'
    with serial.Serial(str(v2_peer.link), 2_000_000, timeout=0.2) as ser:
        names: dict[str, object] = {'ser': ser}
        exec(FEEDBACK, names)  # noqa: S102
    state = names['st']
    assert isinstance(state, DeviceState)
    assert (state.battery, state.roll) == (80, 0.0)
    assert len(state.joint_pos_deg) == len(state.joint_vel_deg_s) == 16


def test_either_protocol_is_found_and_used(peer: PtyPeer) -> None:
    """Version, battery, IMU and servos by id, whichever the robot speaks."""
    peer.behaviour.attitude = (1.5, -2.5, 90.0)
    with XgoDog(str(peer.link)) as dog:
        assert dog.protocol == peer.protocol.name
        assert (dog.read_version(), dog.system_read_battery()) == ('L-2.0.0', 80)
        if dog.protocol == 'v2':
            dog.system_set_feedback(1)
        imu = dog.read_imu()
        assert (imu.roll, imu.pitch, imu.yaw) == (1.5, -2.5, 90.0)
        assert sum(a * a for a in imu.acceleration) ** 0.5 == pytest.approx(9.8, abs=0.01)
        dog.write_servo_angles({11: 10.0, 42: -20.0})
        assert dog.read_version()  # the answer comes behind what was sent before
    assert peer.angles[11] == pytest.approx(10.0, abs=0.4)
    assert peer.angles[42] == pytest.approx(-20.0, abs=0.4)


def test_a_silent_port_has_the_remedy_of_its_kind(tmp_path: Path) -> None:
    """Behind a pseudo-terminal is a simulated robot, which nobody can switch on."""
    (tmp_path / 'link').symlink_to('/dev/pts/0')
    (tmp_path / 'xgo').symlink_to('/dev/ttyUSB0')
    assert 'simulated robot' in silence_cause(str(tmp_path / 'link'))
    for path in (tmp_path / 'xgo', '/dev/ttyAMA0'):
        assert silence_cause(str(path)) == 'is it switched on, and is this its port?'


def test_what_a_robot_cannot_do_is_said(tmp_path: Path) -> None:
    """Protocol v1 pushes nothing; a silent port is a time-out; no port names the remedy."""
    with PtyPeer(tmp_path / 'port', V1) as peer:
        with XgoDog(str(peer.link)) as dog, pytest.raises(XgoNotSupportedError, match='read_imu'):
            dog.system_set_feedback(1)
        peer.behaviour.silent = True
        with pytest.raises(XgoTimeoutError, match=r'115200 baud.*simulated robot'):
            XgoDog(str(peer.link))
    with pytest.raises(XgoError, match='no such device'):
        XgoDog(str(tmp_path / 'nothing'))


def test_a_wrong_motor_or_angle_is_refused(v2_peer: PtyPeer) -> None:
    """Nothing is sent, not even for the motors that are right.

    A second program gets an error, for the port is taken, and steals no bytes.
    """
    with XgoDog(str(v2_peer.link)) as dog:
        with pytest.raises(ValueError, match='no motor has id 14'):
            dog.write_servo_angles({11: 1.0, 14: 1.0})
        with pytest.raises(ValueError, match='motor 12: nan'):
            dog.write_servo_angles({11: 1.0, 12: float('nan')})
        with pytest.raises(XgoError, match='another program has it open'):
            XgoDog(str(v2_peer.link))
        assert dog.read_version()
    assert v2_peer.commands == []


def test_slots_of_the_feedback() -> None:
    """Motors stand in the order of their ids, and the states are in that order."""
    assert [feedback_slot_of(motor) for motor in LEG_MOTORS] == list(range(12))
    wire = state_frame(position=tuple(float(n) for n in range(16))).encode(V2)
    (state,) = SendStateParser().feed_bytes(b'\x55\x00noise' + wire)
    assert state.joint_pos_deg[feedback_slot_of(21)] == 3.0


@pytest.mark.parametrize('order', [['ours', 'vendor'], ['vendor', 'ours'], ['ours', 'copy']])
def test_the_vendors_library_is_used_where_there_is_one(tmp_path: Path, order: list[str]) -> None:
    """Whatever the order of the path; submodules come from the same place.

    A second copy of ours, as of source tree and installation, is not taken for the vendor's.
    """
    vendor, copy = tmp_path / 'vendor' / 'xgo_lib2', tmp_path / 'copy' / 'xgo_lib2'
    for folder in (vendor, copy.parent):
        folder.mkdir(parents=True)
    (vendor / '__init__.py').touch()
    (vendor / 'client.py').touch()
    copy.symlink_to(ROOT / 'xgo_lib2')
    folders = {'ours': ROOT, 'vendor': vendor.parent, 'copy': copy.parent}
    code = (
        'import sys; sys.path[:0] = sys.argv[1:]; import xgo_lib2.client as c; print(c.__file__)'
    )
    command = [sys.executable, '-c', code, *(str(folders[name]) for name in order)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    expected = vendor if 'vendor' in order else ROOT / 'xgo_lib2'
    assert done.stdout.strip() == str(expected / 'client.py')
