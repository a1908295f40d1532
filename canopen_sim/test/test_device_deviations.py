# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Deviations on request: each is seen on the bus, ends, and repeats with its seed."""

from __future__ import annotations

from pathlib import Path
import re

from device_rig import EDS, ENABLE, FAULT_RESET, moving, NODE_ID, Rig, SHUTDOWN, still, SWITCH_ON
from drive_samples import drive_dictionary
import pytest

from arm_canopen import DriveState
from canopen_core.can import Frame
from canopen_core.eds import load_eds
from canopen_core.standard import AbortCode, NmtCommand, NmtState, sdo
from canopen_sim import Device, DeviceHost, Fault, FaultInjection
from canopen_sim.deviations import FAULTS, parse_fault

SDO_ANSWER, TPDO1, HEARTBEAT = 0x580 + NODE_ID, 0x180 + NODE_ID, 0x700 + NODE_ID
READ_DEVICE_TYPE = sdo.UploadRequest(0x1000, 0).encode()
CODES = [fault for fault in Fault if fault.value.code]


@pytest.fixture
def rig() -> Rig:
    """A drive in Pre-operational."""
    rig = Rig()
    rig.take()
    return rig


def synchronous(rig: Rig) -> None:
    """Go Operational with TPDO 1 at each SYNC."""
    rig.put(0x1800, 1, 2)
    rig.nmt(NmtCommand.START)
    rig.take()


def answers(rig: Rig) -> bool:
    """Return whether the device answers an SDO."""
    return rig.raw_sdo(READ_DEVICE_TYPE) is not None


# --- the table ---


def test_every_fault_has_words_and_a_row_in_the_readme() -> None:
    """A fault with its defaults is valid; README.md lists its settings."""
    for fault in Fault:
        assert str(FaultInjection(fault)).startswith(f'{fault.label}: ')
    text = (Path(__file__).parents[1] / 'README.md').read_text('utf-8')
    listed = {
        name: set(re.findall(r'`(\w+)`', row[2]))
        for row in re.findall(r'^\| (`[^|]*) \|([^|]*)\|([^|]*)\|$', text, re.MULTILINE)
        for name in re.findall(r'`(\w+)`', row[0])
    }
    assert {name: listed.get(name) for name in FAULTS} == {
        fault.label: set(fault.value.settings) for fault in Fault
    }
    named = re.findall(r':=([\w/]+\.(?:yml|eds))', text)  # of commands to copy
    assert named
    assert [name for name in named if not (Path(__file__).parents[2] / name).is_file()] == []


@pytest.mark.parametrize(
    ('name', 'settings', 'injection'),
    [
        ('sdo_silence', ['object=0x607d:02', 'count = 2'],
         FaultInjection(Fault.SDO_SILENCE, object=(0x607D, 2), count=2)),
        ('sdo_abort', ['abort=general'], FaultInjection(Fault.SDO_ABORT)),
        ('sdo_abort', ['abort=0x06090030'], FaultInjection(Fault.SDO_ABORT, abort=0x0609_0030)),
        ('reboot', ['position_kept=no'], FaultInjection(Fault.REBOOT, position_kept=False)),
        ('object_kept', ['object=60b0', 'value=-1000'],
         FaultInjection(Fault.OBJECT_KEPT, object=(0x60B0, 0), value=-1000)),
        ('sdo_delay', ['delay=0.1', 'duration=2'],
         FaultInjection(Fault.SDO_DELAY, delay=0.1, duration=2.0)),
    ],
)  # fmt: skip
def test_faults_as_people_write_them(
    name: str, settings: list[str], injection: FaultInjection
) -> None:
    """A name, and settings as text."""
    assert parse_fault(name, settings, 0.0) == injection


def test_nonsense_is_refused() -> None:
    """Unknown names, settings of other faults and values out of range."""
    for name, settings, word in (
        ('tpdo_lost', [], "did you mean 'tpdo_loss'"),
        ('tpdo_loss', ['probability=1.5'], 'probability'),
        ('tpdo_loss', ['probability=often'], 'expected a number of 0 to 1'),
        ('tpdo_loss', ['delay=1.0'], 'unknown setting'),
        ('tpdo_loss', ['count=-1'], 'count'),
        ('tpdo_loss', ['count'], 'name=value'),
        ('tpdo_loss', ['pdo=1', 'pdo=2'], 'twice'),
        ('sdo_delay', ['delay=-1.0'], 'delay'),
        ('sdo_delay', ['duration=nan'], 'duration'),
        ('sdo_delay', ['object=6064:'], 'expected an object'),
        ('rate_units', ['velocity=0'], 'velocity'),
        ('reboot', ['position_kept=maybe'], 'true or false'),
    ):
        with pytest.raises(ValueError, match=re.escape(word)):
            parse_fault(name, settings, 0.0)


def test_a_fault_needs_what_it_concerns(rig: Rig) -> None:
    """An axis and an object that the device has, and a value that the object can hold."""
    for fault, settings, word in (
        (Fault.OVER_CURRENT, {'axis': 2}, 'has 1 axes'),
        (Fault.OBJECT_KEPT, {}, 'object'),
        (Fault.OBJECT_KEPT, {'object': (0x5FFF, 0)}, 'hold'),
        (Fault.OBJECT_KEPT, {'object': (0x6060, 0), 'value': 200}, 'hold'),
        (Fault.TPDO_LOSS, {'delay': 1.0}, 'no setting'),
    ):
        with pytest.raises(ValueError, match=word):
            rig.inject(fault, **settings)
    assert rig.device.faults.active == ()


def test_faults_of_different_objects_go_on_together(rig: Rig) -> None:
    """A fault of another object does not replace the first one; the same one does."""
    for index in (0x6064, 0x606C, 0x6064):
        rig.inject(Fault.SDO_SILENCE, object=(index, 0))
    assert len(rig.device.faults.active) == 2


# --- frames ---


def test_slow_sdo_answers_late_and_right(rig: Rig) -> None:
    """The answer comes exactly so much later, then the device is quick again."""
    rig.inject(Fault.SDO_DELAY, delay=0.25, duration=1.0)
    start = rig.now
    assert not answers(rig)
    rig.run(0.5)
    assert rig.times(SDO_ANSWER) == pytest.approx([start + 0.25])
    rig.run(0.6)
    assert rig.get(0x1000) == 0x20192
    assert rig.device.faults.active == ()


def test_abort_names_object_and_code(rig: Rig) -> None:
    """The abort code of the fault comes, at the first frame of a transfer."""
    rig.inject(Fault.SDO_ABORT, object=(0x6098, 0), abort=AbortCode.HARDWARE)
    assert rig.refused(0x6098, 35) == AbortCode.HARDWARE
    answer = rig.raw_sdo(sdo.UploadRequest(0x6098, 0).encode())
    assert sdo.decode_response(answer or b'') == sdo.Abort(0x6098, 0, AbortCode.HARDWARE)


def test_silence_of_sdos(rig: Rig) -> None:
    """About one object, until it is ended; or for a number of requests; an empty frame is none."""
    rig.inject(Fault.SDO_SILENCE, object=(0x6064, 0))
    assert rig.raw_sdo(sdo.UploadRequest(0x6064, 0).encode()) is None
    assert answers(rig)
    rig.cure(Fault.SDO_SILENCE)
    assert rig.get(0x6064) == 0
    rig.inject(Fault.SDO_SILENCE, count=2)
    assert [answers(rig) for _ in range(3)] == [False, False, True]
    assert rig.device.faults.active == ()
    rig.inject(Fault.BLOCK_CRC)
    assert rig.raw_sdo(b'') is None
    assert answers(rig)


def test_lost_tpdos_are_the_same_with_the_same_seed() -> None:
    """Two runs lose the same frames; another seed loses others; about the given part is lost."""

    def arrivals(seed: int) -> list[int]:
        rig = Rig()
        synchronous(rig)
        rig.inject(Fault.TPDO_LOSS, probability=0.2, seed=seed)
        arrived = []
        for number in range(500):
            rig.sync()
            if rig.take(TPDO1):
                arrived.append(number)
        return arrived

    first = arrivals(1)
    assert first == arrivals(1)
    assert first != arrivals(2)
    assert 350 < len(first) < 450


def test_late_and_missed_pdos(rig: Rig) -> None:
    """A late TPDO carries what was true when it was sent; an RPDO is lost, or acts later."""
    rig.put(0x1801, 1, 2)
    rig.put(0x1400, 255, 2)
    synchronous(rig)
    rig.inject(Fault.TPDO_DELAY, pdo=1, delay=0.02)
    rig.inject(Fault.RPDO_LOSS, count=1)
    rig.sync()
    start = rig.now
    rig.send(0x200 + NODE_ID, b'\x06\x00')
    rig.run(0.1)
    assert rig.times(TPDO1) == pytest.approx([start + 0.02])
    assert rig.times(0x280 + NODE_ID) == [start]
    assert rig.get(0x6040) == 0
    rig.inject(Fault.RPDO_DELAY, delay=0.05)
    rig.send(0x200 + NODE_ID, b'\x06\x00')
    assert rig.get(0x6040) == 0
    rig.run(0.051)
    assert rig.state is DriveState.READY_TO_SWITCH_ON


def test_heartbeat_stops_and_returns(rig: Rig) -> None:
    """No heartbeat for a while, everything else goes on; a boot-up message still comes."""
    rig.put(0x1017, 100)
    rig.inject(Fault.HEARTBEAT_STOP, duration=1.0)
    start = rig.now
    rig.run(0.9)
    assert rig.times(HEARTBEAT) == []
    assert answers(rig)
    rig.nmt(NmtCommand.RESET_COMMUNICATION)
    assert rig.take(HEARTBEAT) == [b'\x00']
    rig.put(0x1017, 100)
    rig.run(1.0)
    assert min(rig.times(HEARTBEAT)) >= start + 1.0


def test_other_devices_of_the_process_are_not_touched() -> None:
    """A fault belongs to one device; frames that it loses do not reach its neighbours either."""
    sent: list[Frame] = []
    host = DeviceHost(sent.append)
    first: Device = host.add(2, drive_dictionary())
    host.add(3, drive_dictionary())
    host.advance(1.0)
    sent.clear()
    first.faults.inject(FaultInjection(Fault.DISCONNECT), 1.0)
    for node_id in (2, 3):
        host.receive(Frame(0x600 + node_id, READ_DEVICE_TYPE), 1.0)
    assert [frame.can_id for frame in sent] == [0x583]


# --- the device ---


def test_objects_that_deviate(rig: Rig) -> None:
    """0x1018 shows other values, an object holds its value, over resets and until the end."""
    vendor, product = rig.get(0x1018, 1), rig.get(0x1018, 2)
    rig.inject(Fault.WRONG_IDENTITY, product=0x1234, device_type=0x191)
    rig.inject(Fault.OBJECT_KEPT, object=(0x60B0, 0), value=-1_000)
    rig.put(0x60B0, 5)
    rig.nmt(NmtCommand.RESET_NODE)
    assert (rig.get(0x1018, 1), rig.get(0x1018, 2)) == (vendor, 0x1234)
    assert (rig.get(0x1000), rig.get(0x60B0)) == (0x191, -1_000)
    rig.cure()
    assert (rig.get(0x1018, 2), rig.get(0x60B0)) == (product, 0)
    rig.inject(Fault.WRONG_IDENTITY)
    assert rig.get(0x1018, 1) != vendor


def test_device_without_power_is_silent_and_starts_anew(rig: Rig) -> None:
    """No frame while it is off; then boot-up, and objects with their defaults."""
    rig.put(0x1017, 100)
    rig.put(0x6081, 4711)
    rig.inject(Fault.POWER_OFF, duration=2.0)
    start = rig.now
    rig.take()
    assert not answers(rig)
    rig.send(0, b'\x82\x00')
    rig.run(1.9)
    assert rig.sent == []
    rig.run(0.2)
    assert rig.sent == [(start + 2.0, Frame(HEARTBEAT, b'\x00'))]
    assert rig.get(0x6081) != 4711
    assert rig.nmt_state is NmtState.PRE_OPERATIONAL
    rig.inject(Fault.FRAME_LOSS, probability=1.0)
    rig.inject(Fault.POWER_OFF)
    rig.run(5.0)
    assert not rig.device.powered
    rig.cure()  # of all: power again, and a good line
    assert answers(rig)
    rig.take()
    rig.inject(Fault.REBOOT)  # at once
    rig.run(0.01)
    assert rig.take(HEARTBEAT) == [b'\x00']


@pytest.mark.parametrize('kept', [True, False])
def test_reboot_in_motion(kept: bool) -> None:
    """The motor runs out; the position is kept, or counts from 0; nothing moves afterwards."""
    rig = moving()
    where = rig.position
    rig.inject(Fault.REBOOT, position_kept=kept, duration=0.5)
    rig.run(0.6)
    assert rig.nmt_state is NmtState.PRE_OPERATIONAL
    assert rig.state is DriveState.SWITCH_ON_DISABLED
    position = rig.get(0x6064)
    assert (position > where) if kept else (position == 0)
    rig.run(1.0)
    assert rig.get(0x6064) == position


# --- drives ---


@pytest.mark.parametrize('mode', [1, 2, 3, 4, 6, 7, 8, 9, 10])
def test_a_fault_has_its_code_and_stays_while_its_cause_does(mode: int) -> None:
    """In each mode: EMCY and 0x603F show the code; a reset helps after the cause is gone only."""
    for fault in CODES:
        rig = Rig()
        rig.enable(mode)
        rig.take()
        rig.inject(fault, duration=1.0)
        rig.run(0.5)
        assert (rig.state, rig.get(0x603F)) == (DriveState.FAULT.value, fault.value.code)
        code = fault.value.code.to_bytes(2, 'little')
        assert [data[:2] for data in rig.take(0x080 + NODE_ID)] == [code]
        rig.command(FAULT_RESET, 0)
        assert rig.state == DriveState.FAULT.value
        rig.run(0.6)
        assert rig.device.faults.active == ()
        rig.command(FAULT_RESET, 0)
        assert (rig.get(0x6041) & 0x4F, rig.get(0x603F)) == (0x40, 0)


def test_a_fault_of_a_moment_and_a_lasting_one(rig: Rig) -> None:
    """Without a duration a reset ends what happened once; without torque there is no ramp."""
    rig.inject(Fault.OVER_CURRENT)
    assert rig.device.faults.active == ()
    rig.command(0, FAULT_RESET, 0)
    assert rig.state is DriveState.SWITCH_ON_DISABLED
    for fault, expected in (
        (Fault.OVER_TEMPERATURE, DriveState.FAULT_REACTION_ACTIVE),
        (Fault.ENCODER_LOSS, DriveState.FAULT),
    ):
        rig = moving()
        rig.inject(fault)
        assert rig.state is expected


def test_safe_torque_off_is_no_fault() -> None:
    """STO takes voltage and torque away; the drive goes on only after it is high again."""
    rig = moving()
    rig.inject(Fault.STO)
    assert rig.state is DriveState.SWITCH_ON_DISABLED
    assert (rig.statusword & 0x10, rig.get(0x6079), rig.get(0x603F)) == (0, 0, 0)
    rig.run(1.0)
    assert rig.velocity == 0.0
    rig.command(SHUTDOWN, SWITCH_ON, ENABLE)
    assert rig.get(0x6041) & 0x6F == 0x21
    rig.cure(Fault.STO)
    assert rig.get(0x6041) & 0x6F == 0x27


@pytest.mark.parametrize('mode', [4, 10])
def test_load_pulls_unless_the_torque_holds_it(mode: int) -> None:
    """With the torque of the load the axis stays; without, it goes where gravity pulls.

    A torque against a stop is no fault; the motor rests there and moves when it is gone.
    """
    rig = Rig()
    rig.enable(8)
    rig.drive.set_load(300.0, rig.now)
    assert rig.get(0x6077) == 300  # the position loop holds it
    rig.put(0x6071, 300)
    rig.put(0x6060, mode)
    rig.put(0x6071, 300)
    rig.run(1.0)
    assert rig.position == pytest.approx(0.0, abs=1.0)
    rig.put(0x6071, 0)
    rig.run(0.5)
    assert rig.position < -50.0
    assert rig.velocity < 0.0
    rig.drive.block(100.0, rig.now)
    rig.put(0x6071, 500)
    rig.run(3.0)
    assert rig.position == pytest.approx(100.0)
    assert rig.state is DriveState.OPERATION_ENABLED
    rig.drive.release(rig.now)
    rig.run(0.5)
    assert rig.position > 200.0


def test_axes_are_apart_and_share_their_errors() -> None:
    """Two axes have objects of their own; EMCY and 0x1001 are the device's."""
    rig = Rig(load_eds(EDS.with_name('cia402_two_axes.eds')).dictionary)
    rig.put(0x6860, 3)
    rig.put(0x68FF, 1000)
    for word in (SHUTDOWN, SWITCH_ON, ENABLE):
        rig.put(0x6840, word)
    rig.run(1.0)
    assert rig.get(0x6864) == pytest.approx(950, abs=10)
    assert (rig.get(0x6064), rig.state) == (0, DriveState.SWITCH_ON_DISABLED)
    rig.take()
    rig.inject(Fault.OVER_TEMPERATURE)  # of both
    rig.run(0.5)
    assert (rig.get(0x603F), rig.get(0x683F)) == (0x4310, 0x4310)
    rig.command(FAULT_RESET)
    assert rig.get(0x1001) & 0x08
    rig.put(0x6840, FAULT_RESET)
    assert rig.get(0x1001) == 0
    assert len(rig.take(0x080 + NODE_ID)) == 2


# --- a moving drive that the network or a fault takes away from its master ---

MODES = (1, 3, 7, 8)


@pytest.mark.parametrize('mode', MODES)
@pytest.mark.parametrize('end', ['stop', 'reset communication', 'reset node', 'fault'])
def test_nothing_moves_by_itself_afterwards(end: str, mode: int) -> None:
    """Off the network the drive stops in a fault that can be seen; after a reset it runs out.

    In Pre-operational it goes on: its master speaks SDO to it.
    """
    rig = moving(mode)
    rig.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
    rig.run(0.1)
    assert rig.state == DriveState.OPERATION_ENABLED.value
    assert rig.velocity == pytest.approx(500, abs=5)
    if end == 'fault':
        rig.drive.raise_fault(0x4310, rig.now)
        rig.put(0x60FF, 0)
    else:
        rig.nmt(NmtCommand[end.upper().replace(' ', '_')])
    if end == 'reset node':
        assert rig.nmt_state is NmtState.PRE_OPERATIONAL
        assert rig.state is DriveState.SWITCH_ON_DISABLED
        assert rig.velocity > 0
    assert still(rig)
    rig.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
    if end in {'stop', 'reset communication'}:
        assert (rig.state, rig.get(0x603F)) == (DriveState.FAULT, 0x8130)
        assert rig.get(0x1001) == 0x11
        rig.put(0x60FF, 0)
    stopped = rig.get(0x6064)
    rig.command(0x00, FAULT_RESET, SHUTDOWN, SWITCH_ON, ENABLE)
    assert rig.state is DriveState.OPERATION_ENABLED
    assert still(rig)
    assert rig.get(0x6064) == stopped


def test_faults_show_at_once_and_a_second_keeps_the_state() -> None:
    """An event-driven statusword shows a fault; one during the reaction is reported, too."""
    rig = moving(3)
    rig.take()
    rig.drive.raise_fault(0x2310, rig.now)
    rig.run(0.005)
    rig.drive.raise_fault(0x4310, rig.now)
    assert rig.drive.state is DriveState.FAULT_REACTION_ACTIVE
    assert still(rig)
    words = [int.from_bytes(data, 'little') & 0x4F for data in rig.take(TPDO1)]
    assert words == [0x0F, 0x08]
    assert rig.drive.faults == {0x2310, 0x4310}
    assert rig.get(0x603F) == 0x4310
