# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""PDOs of a simulated device: transmission types, timers, and the rules of changing them."""

from __future__ import annotations

from device_rig import NODE_ID, Rig
from drive_samples import drive_dictionary, with_defaults
import pytest

from canopen_core.can import Frame
from canopen_core.standard import AbortCode, NmtCommand

DISABLED = 0x8000_0000
NO_RTR = 0x4000_0000
TPDO1 = 0x180 + NODE_ID
RPDO1 = 0x200 + NODE_ID
EMCY = 0x080 + NODE_ID


def configure(
    rig: Rig,
    number: int,
    mapping: list[int],
    *,
    transmission: int,
    inhibit: int = 0,
    event: int = 0,
    sync_start: int = 0,
    can_id: int = 0,
) -> int:
    """Configure a TPDO in the order of CiA 301; return its identifier."""
    can_id = can_id or 0x180 + 0x100 * (number - 1) + NODE_ID
    parameters = {2: transmission, 3: inhibit, 5: event, 6: sync_start}
    return _write(rig, 0x1800 + number - 1, can_id, mapping, parameters)


def receive(
    rig: Rig, number: int, mapping: list[int], transmission: int = 255, event: int = 0
) -> int:
    """Configure an RPDO; return its identifier."""
    can_id = 0x200 + 0x100 * (number - 1) + NODE_ID
    return _write(rig, 0x1400 + number - 1, can_id, mapping, {2: transmission, 5: event})


def _write(
    rig: Rig, communication: int, can_id: int, mapping: list[int], parameters: dict[int, int]
) -> int:
    objects = communication + 0x200
    rig.put(communication, DISABLED | can_id, 1)
    for subindex, value in parameters.items():
        rig.put(communication, value, subindex)
    rig.put(objects, 0)
    for subindex, word in enumerate(mapping, start=1):
        rig.put(objects, word, subindex)
    rig.put(objects, len(mapping))
    rig.put(communication, can_id, 1)
    return can_id


@pytest.fixture
def rig() -> Rig:
    """A device in Pre-operational whose PDOs are all off."""
    rig = Rig()
    for number in range(4):
        for communication in (0x1400, 0x1800):
            rig.put(communication + number, DISABLED, 1)
    rig.take()
    return rig


@pytest.mark.parametrize('divider', [1, 2, 7, 240])
def test_cyclic_synchronous(rig: Rig, divider: int) -> None:
    """Type n is sent at each n-th SYNC, changed or not."""
    can_id = configure(rig, 1, [0x60410010], transmission=divider)
    rig.nmt(NmtCommand.START)
    rig.take()
    for number in range(1, 2 * divider + 1):
        rig.sync()
        assert len(rig.take(can_id)) == (number % divider == 0)


def test_acyclic_synchronous(rig: Rig) -> None:
    """Type 0 is sent at the SYNC after a change, and only then."""
    can_id = configure(rig, 1, [0x60410010], transmission=0)
    rig.nmt(NmtCommand.START)
    for sent in (b'\x50\x02', b'\x31\x02'):
        assert rig.take(can_id) == []
        rig.sync()
        assert rig.take(can_id) == [sent]
        rig.sync()
        assert rig.take(can_id) == []
        rig.command(0x06)


@pytest.mark.parametrize('transmission', [254, 255])
def test_event_driven(rig: Rig, transmission: int) -> None:
    """Types 254 and 255 are sent on entering Operational and at each change, without SYNC."""
    can_id = configure(rig, 1, [0x60410010], transmission=transmission)
    rig.nmt(NmtCommand.START)
    assert rig.take(can_id) == [b'\x50\x02']
    rig.run(5.0)
    rig.sync()
    assert rig.take(can_id) == []
    rig.command(0x06)
    assert rig.take(can_id) == [b'\x31\x02']
    rig.command(0x06)
    assert rig.take(can_id) == []


def test_event_timer(rig: Rig) -> None:
    """The event timer sends unchanged values; a change starts it anew."""
    can_id = configure(rig, 1, [0x60410010], transmission=255, event=100)
    rig.nmt(NmtCommand.START)
    start = rig.now
    rig.run(0.25)
    rig.command(0x06)
    rig.run(0.21)
    assert rig.times(can_id) == pytest.approx([start + t for t in (0, 0.1, 0.2, 0.25, 0.35, 0.45)])


def test_inhibit_time(rig: Rig) -> None:
    """Changes within it are sent together at its end; it limits the event timer, too."""
    can_id = configure(rig, 1, [0x60410010], transmission=255, inhibit=1000)  # 100 ms
    fast = configure(rig, 2, [0x60610008], transmission=255, inhibit=1000, event=30)
    rig.nmt(NmtCommand.START)
    start = rig.now
    rig.run(0.01)
    rig.command(0x06)
    rig.command(0x07)
    rig.run(0.24)
    assert rig.times(can_id) == pytest.approx([start, start + 0.1])
    assert rig.times(fast) == pytest.approx([start, start + 0.1, start + 0.2])
    assert rig.take(can_id) == [b'\x50\x02', b'\x33\x02']


def test_sync_start_value(rig: Rig) -> None:
    """With a SYNC counter, a PDO begins at its start value and goes on from there."""
    rig.put(0x1019, 10)
    can_id = configure(rig, 1, [0x60410010], transmission=3, sync_start=4)
    rig.nmt(NmtCommand.START)
    sent = []
    for counter in [*range(1, 11), *range(1, 4)]:
        rig.send(0x080, bytes((counter,)))
        sent.append(len(rig.take(can_id)))
    assert sent == [0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1]
    other = configure(rig, 2, [0x60410010], transmission=1, sync_start=4)
    rig.sync()  # without a counter the start value means nothing
    assert len(rig.take(other)) == 1


def test_frames_that_are_sync(rig: Rig) -> None:
    """0x1005 says which; a counter where none is configured is an EMCY 0x8240."""
    can_id = configure(rig, 1, [0x60410010], transmission=1)
    rig.nmt(NmtCommand.START)
    rig.put(0x1005, 0x081)
    rig.take()
    rig.sync()
    assert rig.take() == []
    rig.send(0x081)
    assert len(rig.take(can_id)) == 1
    for data in (b'\x01', b'\x02', b''):
        rig.send(0x081, data)
    assert [data[:2] for data in rig.take(EMCY)] == [b'\x40\x82', b'\x00\x00']


def test_inputs_are_sampled_before_outputs_act(rig: Rig) -> None:
    """At a SYNC the TPDO carries the values before the synchronous RPDO takes effect."""
    can_id = configure(rig, 1, [0x60410010], transmission=1)
    rpdo = receive(rig, 1, [0x60400010], transmission=0)
    rig.nmt(NmtCommand.START)
    rig.take()
    rig.send(rpdo, b'\x06\x00')
    assert rig.get(0x6040) == 0
    rig.sync()
    assert rig.take(can_id) == [b'\x50\x02']
    assert rig.get(0x6040) == 6
    rig.sync()
    assert rig.take(can_id) == [b'\x31\x02']


@pytest.mark.parametrize('transmission', [0, 1, 240])
def test_synchronous_rpdo_acts_once(rig: Rig, transmission: int) -> None:
    """The last synchronous RPDO before a SYNC acts at that SYNC, and not again at the next."""
    rpdo = receive(rig, 1, [0x607A0020], transmission=transmission)
    rig.nmt(NmtCommand.START)
    for value in (1, 2):
        rig.send(rpdo, value.to_bytes(4, 'little'))
    rig.sync()
    assert rig.get(0x607A) == 2
    rig.put(0x607A, 9)
    rig.sync()
    assert rig.get(0x607A) == 9


@pytest.mark.parametrize('transmission', [254, 255])
def test_event_driven_rpdo_acts_at_once(rig: Rig, transmission: int) -> None:
    """Without SYNC; a longer frame is read from its start, bytes of gaps are skipped (7.4.7)."""
    mapping = [0x00060010, 0x60600008, 0x00050008, 0x607A0020]
    rpdo = receive(rig, 1, mapping[1::2], transmission=transmission)
    gaps = receive(rig, 2, mapping, transmission=transmission)
    rig.nmt(NmtCommand.START)
    rig.send(rpdo, b'\x08\x01\x02\x03\x04\xff\xff\xff')
    assert (rig.get(0x6060), rig.get(0x6061), rig.get(0x607A)) == (8, 8, 0x04030201)
    rig.send(gaps, b'\xaa\xaa\x07\xaa\x01\x00\x00\x00')
    assert (rig.get(0x6060), rig.get(0x607A)) == (7, 1)


def test_short_rpdos_are_reported_and_ignored(rig: Rig) -> None:
    """EMCY 0x8210 until the last one is right again; a short one changes nothing."""
    first, second = (receive(rig, n, [0x60600008, 0x607A0020]) for n in (1, 2))
    rig.nmt(NmtCommand.START)
    rig.take()
    for rpdo, data in ((first, b'\x08\x01\x02\x03'), (first, b''), (second, b'\x08')):
        rig.send(rpdo, data)
    assert (rig.get(0x6060), rig.get(0x607A)) == (0, 0)
    assert rig.take(EMCY) == [bytes.fromhex('10 82 11 00 00 00 00 00')]
    rig.send(first, b'\x08\x01\x02\x03\x04')
    assert rig.take(EMCY) == []
    rig.send(second, b'\x08\x01\x02\x03\x04')
    assert rig.take(EMCY) == [bytes(8)]


def test_rpdo_deadline(rig: Rig) -> None:
    """An RPDO that stays away longer than its event timer is an EMCY 0x8250, until it is back."""
    rpdo = receive(rig, 1, [0x607A0020], event=50)
    rig.nmt(NmtCommand.START)
    rig.run(1.0)
    assert rig.take(EMCY) == []
    rig.send(rpdo, bytes(4))
    start = rig.now
    rig.run(1.0)
    assert rig.times(EMCY) == pytest.approx([start + 0.05])
    assert rig.take(EMCY)[0][:2] == b'\x50\x82'
    rig.send(rpdo, bytes(4))
    assert rig.take(EMCY) == [bytes(8)]


def test_remote_frames(rig: Rig) -> None:
    """A remote frame is answered where bit 30 of the COB-ID allows it and the type is 252 up."""
    configure(rig, 1, [0x60410010], transmission=253)
    configure(rig, 2, [0x60410010], transmission=252)
    configure(rig, 3, [0x60410010], transmission=253, can_id=NO_RTR | 0x380 + NODE_ID)
    configure(rig, 4, [0x60410010], transmission=1)
    rig.nmt(NmtCommand.START)
    rig.take()

    def query(can_id: int) -> list[bytes]:
        rig.device.receive(Frame(can_id, is_remote=True), rig.now)
        return rig.take(can_id)

    assert query(0x180 + NODE_ID) == [b'\x50\x02']
    assert query(0x280 + NODE_ID) == []  # nothing was sampled yet
    rig.sync()
    rig.take()
    rig.command(0x06)
    assert query(0x280 + NODE_ID) == [b'\x50\x02']  # as of the last SYNC
    assert query(0x180 + NODE_ID) == [b'\x31\x02']
    assert query(0x380 + NODE_ID) == []
    assert query(0x480 + NODE_ID) == []
    assert query(0x701) == []


ON_TPDO, OFF_TPDO = (0x1800, TPDO1, 1), (0x1800, DISABLED | TPDO1, 1)
ONE_OBJECT = ((0x1A00, 0, 0), (0x1A00, 0x60410010, 1), (0x1A00, 1, 0))
THREE_POSITIONS = ((0x1A00, 0, 0), *((0x1A00, 0x60640020, sub) for sub in (1, 2, 3)))
RANGE, FIXED = AbortCode.VALUE_RANGE, AbortCode.UNSUPPORTED_ACCESS
REFUSALS = [
    # an entry that names no mappable object
    (((0x1A00, 0, 0),), (0x1A00, 0x50000020, 1), AbortCode.NO_OBJECT),
    (((0x1A00, 0, 0),), (0x1A00, 0x60C10520, 1), AbortCode.NO_SUBINDEX),
    (((0x1A00, 0, 0),), (0x1A00, 0x60650020, 1), AbortCode.NOT_MAPPABLE),  # PDOMapping=0
    (((0x1A00, 0, 0),), (0x1A00, 0x60400010, 1), AbortCode.NOT_MAPPABLE),  # rww: only an RPDO
    (((0x1A00, 0, 0),), (0x1A00, 0x10080020, 1), AbortCode.NOT_MAPPABLE),  # a string
    (((0x1A00, 0, 0),), (0x1A00, 0x60410020, 1), AbortCode.NOT_MAPPABLE),  # wrong length
    (((0x1A00, 0, 0),), (0x1A00, 0x00050008, 1), AbortCode.NO_OBJECT),  # a gap, only in an RPDO
    (((0x1600, 0, 0),), (0x1600, 0x60410010, 1), AbortCode.NOT_MAPPABLE),  # ro
    (((0x1600, 0, 0),), (0x1600, 0x60640020, 1), AbortCode.NOT_MAPPABLE),
    # a count over 64 bits, over 8 entries, and with an empty entry below it
    (THREE_POSITIONS, (0x1A00, 3, 0), AbortCode.PDO_LENGTH),
    (THREE_POSITIONS, (0x1A00, 9, 0), AbortCode.VALUE_HIGH),
    ((*THREE_POSITIONS, (0x1A00, 0, 2)), (0x1A00, 2, 0), AbortCode.NO_OBJECT),
    # a PDO that exists is fixed; entries also while the count is set
    ((*ONE_OBJECT, ON_TPDO), (0x1A00, 0, 0), FIXED),
    ((*ONE_OBJECT, ON_TPDO), (0x1A00, 0x60640020, 1), FIXED),
    ((*ONE_OBJECT, OFF_TPDO), (0x1A00, 0x60640020, 1), FIXED),
    ((ON_TPDO,), (0x1800, 5, 3), FIXED),  # inhibit time
    ((ON_TPDO,), (0x1800, 5, 6), FIXED),  # SYNC start value
    ((ON_TPDO,), (0x1800, 0x182, 1), RANGE),
    # identifiers of other services (CiA 301, 7.3.5), and of 29 bits
    *(
        ((), (0x1800, can_id, 1), RANGE)
        for can_id in (0x000, 0x07F, 0x101, 0x180, 0x581, 0x600 + NODE_ID, 0x701)
    ),
    ((), (0x1800, 0x2000_0000 | TPDO1, 1), RANGE),
    ((), (0x1800, 0x800, 1), RANGE),
    # reserved transmission types
    *(((), (index, kind, 2), RANGE) for index in (0x1400, 0x1800) for kind in (241, 250, 251)),
    ((), (0x1400, 252, 2), RANGE),
]

Write = tuple[int, int, int]


@pytest.mark.parametrize(('before', 'wrong', 'code'), REFUSALS)
def test_refused_parameters(
    rig: Rig, before: tuple[Write, ...], wrong: Write, code: AbortCode
) -> None:
    """What a PDO cannot be is refused when it is written, and the old value stays."""
    for index, value, subindex in before:
        rig.put(index, value, subindex)
    index, value, subindex = wrong
    held = rig.get(index, subindex)
    assert rig.refused(index, value, subindex) == code
    assert rig.get(index, subindex) == held


def test_allowed_parameters(rig: Rig) -> None:
    """The same identifier, other bits of it, and everything while the PDO does not exist."""
    for index, value, subindex in (ON_TPDO, ON_TPDO, (0x1800, NO_RTR | TPDO1, 1), OFF_TPDO):
        rig.put(index, value, subindex)
    rig.put(0x1800, DISABLED | 0x182, 1)
    for index, value, subindex in (*ONE_OBJECT, *THREE_POSITIONS, (0x1A00, 2, 0)):
        rig.put(index, value, subindex)
    rig.put(0x6060, 7)
    can_id = configure(rig, 1, [0x60610008] * 8, transmission=1)
    rig.nmt(NmtCommand.START)
    rig.sync()
    assert rig.take(can_id) == [b'\x07' * 8]


def test_changes_take_effect_at_run_time(rig: Rig) -> None:
    """In Operational, a PDO can be switched off, moved and switched on again."""
    can_id = configure(rig, 1, [0x60410010], transmission=1)
    other = configure(rig, 2, [0x60610008], transmission=2)
    rpdo = receive(rig, 1, [0x607A0020])
    rig.nmt(NmtCommand.START)
    rig.sync()
    rig.put(0x1800, DISABLED | can_id, 1)
    rig.put(0x1400, DISABLED | rpdo, 1)
    rig.take()
    rig.sync()
    assert rig.take(can_id) == []
    rig.send(rpdo, bytes((1, 0, 0, 0)))
    assert rig.get(0x607A) == 0
    rig.put(0x1800, 0x1FF, 1)
    rig.put(0x1400, 0x2FF, 1)
    rig.sync()
    rig.send(0x2FF, bytes((1, 0, 0, 0)))
    frames = [frame for _, frame in rig.sent]
    assert [frame.can_id for frame in frames] == [0x1FF]
    assert rig.get(0x607A) == 1
    rig.take()
    rig.sync()
    assert len(rig.take(other)) == 1  # the other one was not disturbed in its count of SYNCs


def test_broken_default_mapping_disables_the_pdo() -> None:
    """A dictionary whose default mapping names nothing gives a device without that PDO."""
    rig = Rig(with_defaults(drive_dictionary(), {(0x1A00, 1): 0x55550010}))
    rig.nmt(NmtCommand.START)
    assert rig.take(TPDO1) == []
