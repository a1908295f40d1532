#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# python-canopen 2.4.1: of LowLimit=0x8000, HighLimit=0x7FFF and DefaultValue=0xFFFF of an INTEGER16 in an EDS, the
# limits are read as signed, the default is not: it is 65535, beyond its own limits, and cannot be sent.
# Expected: -1, by the rule that makes the limits -32768 and 32767.
# Seen: default 65535 min -32768 max 32767; encoded: an error; the default -1 in decimals is read as -1
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet canopen==2.4.1; } || exit 2
venv/bin/python -I - <<'END'
from pathlib import Path

import canopen

HEAD = """[DeviceInfo]
VendorName=demo
[MandatoryObjects]
SupportedObjects=0
[OptionalObjects]
SupportedObjects=1
1=0x605A
[605A]
ParameterName=Quick stop option code
ObjectType=0x7
DataType=0x3
AccessType=rw
PDOMapping=0
LowLimit=0x8000
HighLimit=0x7FFF
"""


def read(default):
    Path('drive.eds').write_text(f'{HEAD}DefaultValue={default}\n')
    return canopen.import_od('drive.eds')[0x605A]


stop = read('0xFFFF')
print('default', stop.default, 'min', stop.min, 'max', stop.max, 'in decimals', read('-1').default)
try:
    encoded = stop.encode_raw(stop.default)
except Exception as error:
    encoded = None
    print('encoded:', error)
as_seen = (stop.default, stop.min, stop.max, encoded) == (65535, -32768, 32767, None)
raise SystemExit(not (as_seen and read('-1').default == -1))
END
