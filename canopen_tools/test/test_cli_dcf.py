# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Files for Lely's tools: byte for byte, read back, and applied to a device."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import canopen
from config_samples import load_text, write_bus
from eds_samples import eds_text
from tool_environment import Output, REPOSITORY

from arm_canopen import BusConfig, load_bus
from arm_canopen.config import SdoWrite
from canopen_core.eds import load_eds
from canopen_tools import lint_eds
from canopen_tools.cli.dcf import device_writes, encode_concise
from canopen_tools.cli.main import main
from canopen_tools.cli.objects import expected_objects
from canopen_tools.dcf_master import master_dcf

PANDA = REPOSITORY / 'arm_bringup' / 'robots' / 'panda' / 'bus.yml'

BUS = """\
master:
  node_id: 1
  driver: ros2_canopen::MasterDriver
  package: canopen_master_driver
  sync_period: 10000
  heartbeat_producer: 100
  # master
joint1:
  node_id: 2
  dcf: drive.eds
  driver: ros2_canopen::Cia402Driver
  package: canopen_402_driver
  heartbeat_producer: 1000
  heartbeat_consumer: true
  error_behavior: {1: 2}
  # joint1
  rpdo:
    1:
      transmission: 1
      mapping: [{index: 0x6040}]
    2:
      enabled: false
  tpdo:
    2:
      cob_id: auto
      inhibit_time: 50
      mapping: [{index: 0x6041}]
  sdo:
    - {index: 0x6081, value: 5}
"""

GOLDEN = bytes.fromhex(
    # number of writes
    '11000000'
    # 0x1016:01, 4 bytes: node 1, 300 ms
    '1610 01 04000000 2C010100'
    # 0x1017:00, 2 bytes: 1000 ms
    '1710 00 02000000 E803'
    # 0x1029:01, 1 byte
    '2910 01 01000000 02'
    # RPDO 1: disabled, transmission type, no mapping, 16 bits of 0x6040, one object, enabled
    '0014 01 04000000 02020080'
    '0014 02 01000000 01'
    '0016 00 01000000 00'
    '0016 01 04000000 10004060'
    '0016 00 01000000 01'
    '0014 01 04000000 02020000'
    # RPDO 2: disabled
    '0114 01 04000000 02030080'
    # TPDO 2: as above, with its inhibit time; its transmission type is that of the EDS
    '0118 01 04000000 82020080'
    '0118 03 02000000 3200'
    '011A 00 01000000 00'
    '011A 01 04000000 10004160'
    '011A 00 01000000 01'
    '0118 01 04000000 82020000'
    # 0x6081:00
    '8160 00 04000000 05000000'
)
"""The concise DCF of the bus above by hand, in the order of dcfgen."""


def edited(old: str, new: str) -> str:
    """Return the bus with a change."""
    assert BUS.count(old) == 1
    return BUS.replace(old, new)


def writes_of(folder: Path, text: str = BUS, *, complete: bool = False) -> list[str]:
    """Return the writes to the first device: ``1400:01=02020080``."""
    config = load_text(folder, text)
    writes = device_writes(config, config.nodes[0], complete=complete)
    return [f'{w.index:04X}:{w.subindex:02X}={w.data.hex().upper()}' for w in writes]


def test_golden_bytes(tmp_path: Path, capsys: Output) -> None:
    """The files are where they are wanted, and named in the DCF of the master."""
    path, out = write_bus(tmp_path, BUS), tmp_path / 'new' / 'folder'
    assert main(['dcf', str(path), '--out', str(out), '-v']) == 0
    assert (out / 'joint1.bin').read_bytes() == GOLDEN
    assert not (out / 'master.bin').exists()
    assert f'UploadFile={out / "joint1.bin"}\n' in (out / 'master.dcf').read_text()
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f'{out / "joint1.bin"}: 17 writes'
    assert '    0x1016:01 Consumer heartbeat time = node 1, 300 ms' in lines
    assert lines[-1] == f'{out / "master.dcf"}: 1 device'


def test_files_of_an_earlier_run_are_no_longer_there(tmp_path: Path, capsys: Output) -> None:
    """A device without anything to write has no file; a wrong bus.yml writes none."""
    plain = BUS[: BUS.index('  heartbeat_producer: 1000')] + '  heartbeat_consumer: false\n'
    (tmp_path / 'joint1.bin').write_bytes(b'old')
    path = write_bus(tmp_path, plain)
    dcf = ['dcf', str(path), '--path', '/opt/arm', '--out']
    assert main([*dcf, str(tmp_path)]) == 0
    assert not (tmp_path / 'joint1.bin').exists()
    assert '[1F22]' not in (tmp_path / 'master.dcf').read_text()
    write_bus(tmp_path, BUS)
    assert main([*dcf, str(tmp_path)]) == 0
    assert 'UploadFile=/opt/arm/joint1.bin\n' in (tmp_path / 'master.dcf').read_text()
    write_bus(tmp_path, edited('node_id: 2', 'node_id: 200'))
    assert main([*dcf, str(tmp_path / 'out')]) == 1
    assert '200 is out of range' in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


SECOND = 'transmission: 3\n      mapping: [{index: 0x607A}]'
EQUAL = {'1017:00=0000', '1029:01=00', '1400:02=FF', '1801:03=0000'}
"""What is as the EDS has it."""


def test_only_what_differs_from_the_eds_is_written(tmp_path: Path) -> None:
    """As dcfgen does; the identifier is switched off and on around every change.

    All on request: a device that stores other values needs those that are equal, too.
    """
    for old, new, present, absent in (
        ('heartbeat_producer: 1000', 'heartbeat_producer: 0', '', '1017:00=0000'),
        ('error_behavior: {1: 2}', 'error_behavior: {1: 0}', '', '1029:01=00'),
        ('heartbeat_consumer: true', 'heartbeat_consumer: false', '', '1016:01=2C010100'),
        ('transmission: 1', 'transmission: 255', '', '1400:02=FF'),
        ('inhibit_time: 50', 'inhibit_time: 0', '', '1801:03=0000'),
        ('inhibit_time: 50', 'event_timer: 20', '1801:05=1400', '1801:03=3200'),
        ('inhibit_time: 50', 'sync_start: 3', '1801:06=03', '1801:03=3200'),
        ('transmission: 1', 'event_deadline: 30', '1400:05=1E00', '1400:02=01'),
        ('cob_id: auto', 'cob_id: 0x6A0', '1801:01=A0060080 1801:01=A0060000', '1801:02=01'),
        ('    2:\n      enabled: false', f'    2:\n      {SECOND}', '1401:02=03', '1401:02=FF'),
    ):
        text = edited(old, new)
        writes = set(writes_of(tmp_path, text))
        assert set(present.split()) <= writes, old
        assert absent not in writes, old
        complete = set(writes_of(tmp_path, text, complete=True))
        assert writes < complete, old
        assert (absent in complete) is (absent in EQUAL), old


def test_an_entry_of_the_eds_is_the_masters_or_left_alone(tmp_path: Path) -> None:
    """Cleared where the device shall not watch the master; one of somebody else stays."""
    for wanted, entry, first in (
        ('false', '0x00010000', SdoWrite(0x1016, 1, bytes(4))),
        ('false', '0x00010064', SdoWrite(0x1016, 1, bytes(4))),
        ('true', '0x00090000', SdoWrite(0x1016, 1, b'\x2c\x01\x01\0')),
        ('true', '0x00090064', None),
    ):
        eds = eds_text().splitlines()
        place = eds.index('DefaultValue=0', eds.index('[1016sub1]'))
        eds[place] = f'DefaultValue={entry}'
        text = edited('heartbeat_consumer: true', f'heartbeat_consumer: {wanted}')
        config = load_text(tmp_path, text, eds='\n'.join(eds))
        watching = [w for w in device_writes(config, config.nodes[0]) if w.index == 0x1016]
        assert watching == ([] if first is None else [first]), wanted
        compared = {item.index for item in expected_objects(config, config.nodes[0])}
        assert (0x1016 in compared) is (first is not None), wanted


def test_expected_numbers_are_in_the_file_of_the_master(tmp_path: Path) -> None:
    """Own serial number, and those that bus.yml names of devices; data of any length."""
    text = edited('# master', 'serial_number: 0x77').replace('# joint1', 'revision_number: 3')
    path = write_bus(tmp_path, text)
    assert main(['dcf', str(path), '--out', str(tmp_path)]) == 0
    golden = '02000000 1810 04 04000000 77000000 871F 02 04000000 03000000'
    assert (tmp_path / 'master.bin').read_bytes() == bytes.fromhex(golden)
    writes = [SdoWrite(0x2001, 2, b'abcde'), SdoWrite(0x2002, 0, b'')]
    golden = '02000000 0120 02 05000000 6162636465 0220 00 00000000'
    assert encode_concise(writes) == bytes.fromhex(golden)


def test_the_bit_rate_is_one_that_the_file_of_the_master_supports(tmp_path: Path) -> None:
    """Also 100 kbit/s, which EDS files have beside those of newer standards."""
    text = master_dcf(load_text(tmp_path, edited('# master', 'baudrate: 100')), {})
    assert '\nBaudrate=100\n' in text
    assert '\nBaudRate_100=1\n' in text
    config = load_text(tmp_path, edited('# master', 'baudrate: 125'))
    assert 'BaudRate_100=' not in master_dcf(config, {})  # dcf-tools 2.4.2 refuses it


class MasterFile:
    """A master.dcf that was read back."""

    def __init__(self, folder: Path, config: BusConfig) -> None:
        """Write and read it."""
        self.path = folder / 'master.dcf'
        files = {node.node_id: f'/opt/{node.name}.bin' for node in config.nodes}
        self.path.write_text(master_dcf(config, files))
        self.dictionary = load_eds(self.path).dictionary.for_node(config.master.node_id)

    def value(self, index: int, subindex: int = 0) -> Any:
        """Return a default."""
        entry = self.dictionary.get(index, subindex)
        assert entry is not None, f'{index:04X}:{subindex:02X}'
        return entry.default


SETTINGS = """\
  sync_window: 5000
  sync_overflow: 10
  emcy_inhibit_time: 100
  nmt_inhibit_time: 20
  boot_time: 4000
  vendor_id: 0x360
  product_code: 7
  start_all_nodes: true
  start_nodes: false
  error_behavior: {1: 1, 2: 2}
  time_cob_id: 0x40000100
"""
OF_MASTER = {
    (0x1005, 0): 0x4000_0080, (0x1006, 0): 10_000, (0x1007, 0): 5000, (0x1012, 0): 0x4000_0100,
    (0x1014, 0): 0x81, (0x1015, 0): 100, (0x1016, 1): 2 << 16 | 3000, (0x1017, 0): 100,
    (0x1018, 1): 0x360, (0x1018, 2): 7, (0x1019, 0): 10, (0x1028, 1): 0x8000_0000,
    (0x1029, 1): 1, (0x1029, 2): 2, (0x102A, 0): 20, (0x1F80, 0): 0x0B, (0x1F81, 2): 0x0000_041D,
    (0x1F84, 2): 0x20192, (0x1F85, 2): 0x555, (0x1F86, 2): 7, (0x1F89, 0): 4000,
}  # fmt: skip


def test_the_master_as_lely_wants_it(tmp_path: Path) -> None:
    """Each key of bus.yml ends up in its object (reference: dcfgen)."""
    keys = '  mandatory: true\n  reset_communication: false\n  retry_factor: 4'
    text = edited('  # master\n', SETTINGS).replace('  # joint1', keys)
    file = MasterFile(tmp_path, load_text(tmp_path, text))
    assert {place: file.value(*place) for place in OF_MASTER} == OF_MASTER


def test_pdos_are_mirrored(tmp_path: Path) -> None:
    """A TPDO of a device is an RPDO of the master, and the other way round; others are not."""
    text = edited('mapping: [{index: 0x6040}]', 'mapping: [{index: 0x6040}, {index: 0x6060}]')
    text = text.replace(
        '    2:\n      cob_id', '    1:\n      mapping: [{index: 0x6041}]\n    2:\n      cob_id'
    )
    text = text.replace('50\n      mapping: [', '50\n      mapping: [{index: 0x6064}, ')
    file = MasterFile(tmp_path, load_text(tmp_path, text))
    value = file.value
    assert [value(0x1400, 1), value(0x1401, 1)] == [0x182, 0x282]
    assert [value(0x1800, 1), value(0x1800, 2)] == [0x202, 1]
    assert not file.dictionary.has_index(0x1801)
    # the statusword is in both TPDOs, and has one place
    assert value(0x1600, 1) == 0x2000_0110
    assert [value(0x1601, 1), value(0x1601, 2)] == [0x2001_0120, 0x2000_0110]
    assert [value(0x1A00, 1), value(0x1A00, 2)] == [0x2200_0110, 0x2200_0208]
    names = [file.dictionary.get(0x2001, 1), file.dictionary.get(0x2200, 2)]
    assert [entry.name for entry in names if entry] == [
        'joint1: Position actual value',
        'joint1: Modes of operation',
    ]
    assert file.dictionary.subindices(0x2001)[-1].subindex == 1
    assert [value(0x5800), value(0x5801), value(0x5C00)] == [0x0102, 0x0202, 0x0102]
    assert [value(0x5A01, 1), value(0x5A01, 2)] == [0x6064_0020, 0x6041_0010]
    assert [value(0x5E00, 1), value(0x5E00, 2)] == [0x6040_0010, 0x6060_0008]


def test_the_file_of_the_article_is_right(tmp_path: Path) -> None:
    """The master of seven joints passes the lint, and both readers agree on it."""
    config = load_bus(PANDA)
    file = MasterFile(tmp_path, config)
    report = lint_eds(file.path)
    assert report.errors == report.warnings == ()
    import_od: Any = canopen.import_od  # python-canopen has no types
    other = import_od(str(file.path))
    assert other.node_id == config.master.node_id
    assert other.bitrate == 1_000_000
    assert {index for index in other if index >= 0x1000} == {
        entry.index for entry in file.dictionary
    }
    for index in (*range(0x1400, 0x140E), *range(0x1800, 0x180E)):
        for entry in file.dictionary.subindices(index):
            assert other[index][entry.subindex].default == entry.default
            assert other[index][entry.subindex].data_type == entry.data_type
    for index in (0x1005, 0x1006, 0x1017, 0x1F80, 0x5800, 0x5C0D):
        assert other[index].default == file.value(index)
