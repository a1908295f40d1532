# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The copies of public interfaces equal the public ones: type hashes (REP 2016), constants."""

import json
from pathlib import Path
from typing import Any

from ament_index_python.packages import get_package_share_directory
from canopen_interfaces.srv import COReadID, COWriteID
import pytest

# computed with rosidl 4.6.6 from the files that ros2_canopen, geometry2, control_msgs, moveit_msgs
# and ros2_control publish for Jazzy
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
    'control_msgs/action/FollowJointTrajectory': (
        '738ebcb7a2d7cfa42f9f1001cc99ce3a4383d1cfe508015d9be8485e4b1c66f6'
    ),
    'control_msgs/msg/DynamicJointState': (
        '18024c98a62697680f581108eeed40b28fb4542fa0ac5a8e36f56c62b6813d26'
    ),
    'control_msgs/msg/InterfaceValue': (
        '74a12144ef6b7af67533195cb30f7f607d3301b66950208a72d280695f3e190c'
    ),
    'control_msgs/msg/JointComponentTolerance': (
        '739ea7566931944d33830fa10f1bf5e7a7fbdc3172bce7a7eaac642bd6e3ffa4'
    ),
    'control_msgs/msg/JointJog': (
        'ba249455a20f70168a1acb7bf43b776b72ff1f7eb5fc4cfea443f749e963c6e7'
    ),
    'control_msgs/msg/JointTolerance': (
        'c254f9cece0f3b733017b6990fd46d1326e25242d6b8844398c97d9a88e7d648'
    ),
    'control_msgs/msg/JointTrajectoryControllerState': (
        '51d8dd89cc624cbe9daaeeb4d80d6de9b86168ffdc3be41fefc0953e3c26e480'
    ),
    'control_msgs/msg/SpeedScalingFactor': (
        '0c240f349f2b74e33e8741f83e0f196ddeb6585923663876ed3c1f51f0566037'
    ),
    'control_msgs/srv/QueryTrajectoryState': (
        '4a0935dffef18bc5b9e101c9d03d84e681ecd4cebd724b8f11fde008751a325a'
    ),
    'controller_manager_msgs/msg/ChainConnection': (
        '2daecd1da4b171f48b291c79747657a651eb1ab8821b68e38b1c88c736bba91c'
    ),
    'controller_manager_msgs/msg/ControllerState': (
        '9a8780ab9814b6032978a07c6c7033cf1a7894ac8d948a6fb72afea07b04cc83'
    ),
    'controller_manager_msgs/srv/ListControllers': (
        '4f8e36bb1fa5afdeba45c2d56ae6a2097b1493a253f961dd6290c085033bd189'
    ),
    'controller_manager_msgs/srv/SwitchController': (
        'd4ad10aa5da7808bc522d55d4123d8ef79de73d049d165639d7663ac37cc9895'
    ),
    'moveit_msgs/msg/ServoStatus': (
        '882a75f7648d6f8a9bf528e4787f51c58f2d5d88b702e450443d99f270e6936b'
    ),
    'moveit_msgs/srv/ServoCommandType': (
        '2065f4daf271249330596d344ecd48f5c2d2a52e3b21b1fc56d99c52b8eeae22'
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
