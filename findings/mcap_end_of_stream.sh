#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# mcap 1.6.0: make_reader() seeks in a stream for the index, yet looks for the start where the stream stands: after a
# recording was written into it, or after its length was measured, there is no recording.
# Expected: a reader that seeks begins at the start by itself.
# Seen: at the end EndOfFile; at byte 50 InvalidMagic; at 0 a SeekingReader with 3 messages
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet mcap==1.6.0; } || exit 2
venv/bin/python -I - <<'END'
import io

from mcap.reader import make_reader
from mcap.writer import Writer

stream = io.BytesIO()
writer = Writer(stream)
writer.start()
schema = writer.register_schema('demo', 'jsonschema', b'{}')
channel = writer.register_channel('/joint_states', 'json', schema)
for second in range(3):
    writer.add_message(channel, second * 10**9, b'{}', second * 10**9)
writer.finish()


def summary():
    try:
        reader = make_reader(stream)
        return type(reader).__name__, reader.get_summary().statistics.message_count
    except Exception as error:
        return (type(error).__name__,)


found = []
for place in (stream.seek(0, io.SEEK_END), 50, 0):
    stream.seek(place)
    found.append(summary())
    print('at', place, *found[-1])
raise SystemExit(found != [('EndOfFile',), ('InvalidMagic',), ('SeekingReader', 3)])
END
