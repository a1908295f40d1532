#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# python-can 4.6.1: its writer of candump logs leaves the length of a remote frame out; its reader knows it.
# Expected: 705#R1, as candump -l of can-utils writes. CANopen's node guarding asks with a remote frame of length 1:
# the same bus in a log of python-can asks with length 0, and converting .blf or .asc to .log loses it too.
# Seen: written (1.000000) can0 705#R R, read length 0; a line 705#R1 is read with length 1
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet python-can==4.6.1; } || exit 2
venv/bin/python -I - <<'END'
from pathlib import Path

import can

with can.CanutilsLogWriter('log.log') as writer:
    writer.on_message_received(
        can.Message(
            timestamp=1.0,
            arbitration_id=0x705,
            is_remote_frame=True,
            dlc=1,
            is_extended_id=False,
            channel='can0',
        )
    )
written = Path('log.log').read_text().strip()
(read,) = can.CanutilsLogReader('log.log')
Path('candump.log').write_text('(1.000000) can0 705#R1\n')
(of_candump,) = can.CanutilsLogReader('candump.log')
print('written', written, 'read', read.dlc, 'of candump', of_candump.dlc)
raise SystemExit(('705#R1' in written, read.dlc, of_candump.dlc) != (False, 0, 1))
END
