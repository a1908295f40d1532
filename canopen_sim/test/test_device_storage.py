# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a simulated device keeps without power: stored parameters, and its identifiers."""

from __future__ import annotations

import logging
from pathlib import Path

from device_rig import drive_dictionary, NODE_ID, Rig
import pytest

from canopen_core.standard import (
    AbortCode,
    COB_ID_INVALID,
    DataType,
    NmtCommand,
    ObjectDictionary,
    ObjectEntry,
)
from canopen_sim import Device, Fault
from canopen_sim.objects.parameter_storage import LOAD, ParameterFile, ParameterMemory, SAVE

SIGNATURES = {0x1010: SAVE, 0x1011: LOAD}


def storing_dictionary() -> ObjectDictionary:
    """Return the simulated drive's dictionary with 0x1010, 0x1011 and 0x1020 for certain."""
    entries = [e for e in drive_dictionary() if e.index not in (0x1010, 0x1011, 0x1020)]
    for index, last in ((0x1010, 3), (0x1011, 3), (0x1020, 2)):
        count = ObjectEntry(index, 0, 'Highest', DataType.UNSIGNED8, default=last)
        default = 0 if index == 0x1020 else 1
        entries += [
            count,
            *(
                ObjectEntry(index, sub, f'{index:X}', DataType.UNSIGNED32, default=default)
                for sub in range(1, last + 1)
            ),
        ]
    return ObjectDictionary(entries)


class StoringRig(Rig):
    """A drive that can store."""

    def __init__(self, memory: ParameterMemory | None = None) -> None:
        """Switch it on."""
        super().__init__(storing_dictionary(), power=False)
        self.device = Device(NODE_ID, storing_dictionary(), self._sent, memory=memory)
        self.device.advance(self.now)
        self.take()

    def order(self, index: int, group: int = 1) -> None:
        """Order it to store (0x1010) or restore (0x1011)."""
        self.put(index, SIGNATURES[index], group)

    def power_cycle(self) -> None:
        """Cut the power, and give it back."""
        self.inject(Fault.REBOOT)
        self.run(0.01)


@pytest.fixture
def rig() -> StoringRig:
    """A drive with another acceleration, heartbeat time and EMCY inhibit time than the EDS has."""
    rig = StoringRig()
    rig.put(0x6083, 4711)
    rig.put(0x1017, 250)
    return rig


def values(rig: StoringRig) -> tuple[int, int]:
    """Return acceleration and heartbeat time."""
    return rig.get(0x6083), rig.get(0x1017)


@pytest.mark.parametrize(
    ('stored', 'reset', 'kept'),
    [
        ((), 'power', False),
        ((0x1010,), 'power', True),
        ((0x1010,), NmtCommand.RESET_NODE, True),
        ((0x1010, 0x1011), 'power', False),
    ],
)
def test_what_is_stored_is_kept(
    rig: StoringRig, stored: tuple[int, ...], reset: object, kept: bool
) -> None:
    """It survives power cuts and resets until it is restored; 0x1010 shows the abilities."""
    for index in stored:
        rig.order(index)
    rig.put(0x6083, 1)
    if isinstance(reset, NmtCommand):
        rig.nmt(reset)
    else:
        rig.power_cycle()
    assert values(rig) == ((4711, 250) if kept else values(StoringRig()))
    assert rig.get(0x1010, 1) == 1


def test_groups(rig: StoringRig) -> None:
    """Communication and application parameters are stored and restored by themselves."""
    default = StoringRig()
    rig.order(0x1010, 3)
    rig.power_cycle()
    assert values(rig) == (4711, default.get(0x1017))
    rig.put(0x1017, 250)
    rig.order(0x1010, 2)
    rig.order(0x1011, 3)
    assert values(rig) == (4711, 250)  # effective after the reset only
    rig.power_cycle()
    assert values(rig) == (default.get(0x6083), 250)


@pytest.mark.parametrize('index', [0x1010, 0x1011])
def test_other_words_than_the_signature(rig: StoringRig, index: int) -> None:
    """Nothing is stored or restored by mistake (CiA 301, 7.5.2.13)."""
    for value in (0, 1, SAVE if index == 0x1011 else LOAD):
        assert rig.refused(index, value, 1) == AbortCode.DATA_TRANSFER


def test_commands_are_no_parameters(rig: StoringRig) -> None:
    """Controlword, mode and targets are not stored: nothing moves after a power cut."""
    rig.enable(1)
    rig.put(0x607A, 50_000)
    rig.order(0x1010)
    rig.power_cycle()
    assert (rig.get(0x6040), rig.get(0x6060), rig.get(0x607A)) == (0, 0, 0)
    rig.nmt(NmtCommand.START)
    rig.run(2.0)
    assert rig.get(0x6064) == 0


def test_stored_pdos_are_those_of_the_next_start(rig: StoringRig) -> None:
    """A stored PDO configuration is in force after the boot-up without being written."""
    rig.put(0x1800, COB_ID_INVALID | 0x1FE, 1)
    rig.put(0x1800, 0x40000000 | 0x1FE, 1)
    rig.put(0x1800, 1, 2)
    rig.order(0x1010, 2)
    rig.power_cycle()
    rig.nmt(NmtCommand.START)
    rig.take()
    rig.sync()
    assert len(rig.take(0x1FE)) == 1


def test_verify_configuration(rig: StoringRig) -> None:
    """0x1020 is stored with what it stands for, and erased when something else is stored."""
    rig.put(0x1020, 14_000, 1)
    rig.put(0x1020, 3_600_000, 2)
    rig.order(0x1010)
    rig.power_cycle()
    assert (rig.get(0x1020, 1), rig.get(0x1020, 2)) == (14_000, 3_600_000)
    rig.order(0x1010)
    assert rig.get(0x1020, 1) == 14_000
    rig.put(0x6083, 1)
    rig.order(0x1010, 3)
    rig.power_cycle()
    assert (rig.get(0x1020, 1), rig.get(0x1020, 2)) == (0, 0)


def test_file_outlives_the_process(tmp_path: Path) -> None:
    """Another device with the same file begins with what the first one has stored."""
    path = tmp_path / 'deep' / 'node_5.json'
    first = StoringRig(ParameterFile(path))
    first.put(0x6083, 4711)
    assert not path.exists()
    first.order(0x1010)
    assert StoringRig(ParameterFile(path)).get(0x6083) == 4711
    assert [file.name for file in path.parent.iterdir()] == ['node_5.json']


@pytest.mark.parametrize(
    'text', ['', 'null', '[]', '{}', '{"version": 2}', '{"version": 1, "values": []}',
             '{"version": 1, "values": {"x": "00"}}'],
)  # fmt: skip
def test_damaged_file(tmp_path: Path, text: str, caplog: pytest.LogCaptureFixture) -> None:
    """A file that is damaged is said, and the defaults count."""
    path = tmp_path / 'node_5.json'
    path.write_text(text, encoding='utf-8')
    with caplog.at_level(logging.ERROR):
        rig = StoringRig(ParameterFile(path))
    assert values(rig) == values(StoringRig())
    assert str(path) in caplog.text


def test_values_of_another_dictionary() -> None:
    """Stored values that do not fit the objects are passed over."""
    memory = ParameterMemory()
    memory.values = {
        (0x6083, 0): b'\x01',
        (0x5FFE, 0): b'\x01',
        (0x1000, 0): bytes(4),
        (0x6084, 0): b'\x39\x30\x00\x00',
    }
    rig = StoringRig(memory)
    assert rig.get(0x6083) == StoringRig().get(0x6083)
    assert rig.get(0x1000) == 0x20192
    assert rig.get(0x6084) == 12345
