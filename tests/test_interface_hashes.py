# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The copies of public interfaces equal the public ones: type hashes (REP 2016), constants."""

import json
from pathlib import Path
from typing import Any

from ament_index_python.packages import get_package_share_directory
from canopen_interfaces.srv import COReadID, COWriteID
import pytest

# computed with rosidl 4.6.6 from the files that ros2_canopen and geometry2 publish for Jazzy
PUBLIC_HASHES = {
    'canopen_interfaces/msg/COData': (
        '734aa4992e7102aa6fa1d5796932c1d7e2976ce7c59e8ac2c04ec162d7909798'
    ),
    'canopen_interfaces/srv/COHeartbeatID': (
        'ee147720312535a590bd763939c3669887efc22e4fddc78c2b5d02150fb5273e'
    ),
    'canopen_interfaces/srv/CONmtID': (
        '255a731423840e660325932558326e1d5147f27497a1e6791cd465cfe985016a'
    ),
    'canopen_interfaces/srv/CONode': (
        '9151223d73e2733efcf66738cef354018c120b72eb835cfff432b4abce717d6b'
    ),
    'canopen_interfaces/srv/CORead': (
        '6a64047cdf2629e0c55f9fde5567281b8a4c817df02fd396add8e25bbae4d78f'
    ),
    'canopen_interfaces/srv/COReadID': (
        'fa937c1eb9de631880e04fc4133e9778e0f1e202e15bc3d28397463a4e9de476'
    ),
    'canopen_interfaces/srv/COTargetDouble': (
        'e886e3912f525a37f2807d58541cf8d20aba1d9050eceee14c47f586912fd137'
    ),
    'canopen_interfaces/srv/COWrite': (
        '1b90069d4f5fbcf64116330530d4832f5695974911d375647c731335a4663bee'
    ),
    'canopen_interfaces/srv/COWriteID': (
        '5a74e2892f03f1db277dac8ac3d9bd695e832f26c6762465b8d3194aa2a70420'
    ),
    'tf2_msgs/msg/TFMessage': 'e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087',
}


def built_hash(interface: str) -> str:
    """Read the hash that rosidl computed while it built an interface."""
    package, kind, name = interface.split('/')
    path = Path(get_package_share_directory(package), kind, f'{name}.json')
    entries = json.loads(path.read_text(encoding='utf-8'))['type_hashes']
    (value,) = (entry['hash_string'] for entry in entries if entry['type_name'] == interface)
    return str(value)


@pytest.mark.parametrize('interface', PUBLIC_HASHES)
def test_hash_equals_the_public_one(interface: str) -> None:
    """A peer that was built from the public files accepts our messages."""
    assert built_hash(interface) == f'RIHS01_{PUBLIC_HASHES[interface]}'


def test_every_interface_of_a_copied_package_is_compared() -> None:
    """An interface that is added to interfaces/ needs its public hash here."""
    folder = Path(__file__).parents[1] / 'interfaces'
    written = {
        f'{path.parts[-3]}/{path.parts[-2]}/{path.stem}'
        for suffix in ('msg', 'srv', 'action')
        for path in folder.glob(f'*/{suffix}/*.{suffix}')
    }
    assert written == set(PUBLIC_HASHES)


@pytest.mark.parametrize('service', [COReadID, COWriteID])
def test_data_type_constants(service: type[Any]) -> None:
    """The hash leaves constants out; they are the type numbers of CiA 301, table 44."""
    names = ('INT8', 'INT16', 'INT32', 'UINT8', 'UINT16', 'UINT32')
    values = [getattr(service.Request, f'CANOPEN_DATATYPE_{name}') for name in names]
    assert values == [2, 3, 4, 5, 6, 7]
