#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# mcap-ros2-support 0.6.0: the writer takes a dict with a misspelt field, or with None, and writes 0 without a word.
# Expected: an error that names the field, as messages of rosbags raise. The recording is valid, and its axis stands still.
# Seen: velocity 1.5 is read as 1.5; velocty 1.5 as 0.0; velocity None as 0.0
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet mcap-ros2-support==0.6.0; } || exit 2
venv/bin/python -I - <<'END'
import io

from mcap_ros2.reader import read_ros2_messages
from mcap_ros2.writer import Writer

stream = io.BytesIO()
writer = Writer(stream)
schema = writer.register_msgdef('demo/msg/Axis', 'float64 velocity')
written = [{'velocity': 1.5}, {'velocty': 1.5}, {'velocity': None}]
for message in written:
    writer.write_message('/axis', schema, message)
writer.finish()
stream.seek(0)
read = [message.ros_msg.velocity for message in read_ros2_messages(stream)]
for before, after in zip(written, read):
    print(before, 'is read as', after)
raise SystemExit(read != [1.5, 0.0, 0.0])
END
