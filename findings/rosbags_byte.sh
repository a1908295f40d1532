#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# rosbags 0.11.9: a field of type `byte` in a ROS 2 message is read as a signed number, and 200 cannot be written.
# Expected: 200, as ROS 2 maps `byte` to octet, which has no sign. uint8 is read rightly.
# Seen: byte 200 is read as -56, byte[] as int8 [-56]; written: byte format requires -128 <= number <= 127
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet rosbags==0.11.9; } || exit 2
venv/bin/python -I - <<'END'
from rosbags.typesys import Stores, get_typestore, get_types_from_msg

store = get_typestore(Stores.ROS2_JAZZY)
store.register(get_types_from_msg('byte[] data', 'demo/msg/Bytes'))
header = b'\x00\x01\x00\x00'  # CDR, little-endian
one = store.deserialize_cdr(header + b'\xc8', 'std_msgs/msg/Byte').data
same = store.deserialize_cdr(header + b'\xc8', 'std_msgs/msg/UInt8').data
many = store.deserialize_cdr(header + b'\x01\x00\x00\x00\xc8', 'demo/msg/Bytes').data
print('byte', one, 'uint8', same, 'byte[]', many.dtype, many)
try:
    store.serialize_cdr(store.types['std_msgs/msg/Byte'](data=200), 'std_msgs/msg/Byte')
    refused = False
except Exception as error:
    print('written:', error)
    refused = True
raise SystemExit((one, same, many.tolist(), refused) != (-56, 200, [-56], True))
END
