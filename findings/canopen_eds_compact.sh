#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# python-canopen 2.4.1: an array with CompactSubObj=3 in an EDS has two sub-indices after it was read, sub-index 0 without a
# value, while any other sub-index is answered; written to a file again, sub-indices 2 and 3 are lost.
# Expected: sub-indices 0 (of value 3) to 3, none beyond, and the same ones in the file that is written.
# Seen: length 2, number of entries None, sub-index 9 is Limit_9; written [2000sub0] [2000sub1]
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet canopen==2.4.1; } || exit 2
venv/bin/python -I - <<'END'
import re
from pathlib import Path

import canopen

Path('drive.eds').write_text("""[DeviceInfo]
VendorName=demo
[MandatoryObjects]
SupportedObjects=0
[ManufacturerObjects]
SupportedObjects=1
1=0x2000
[2000]
ParameterName=Limit
ObjectType=0x8
DataType=0x6
AccessType=rw
DefaultValue=7
PDOMapping=0
CompactSubObj=3
""")
limits = canopen.import_od('drive.eds')[0x2000]
beyond = limits[9].name
with open('written.eds', 'w') as file:
    canopen.export_od(canopen.import_od('drive.eds'), file, doc_type='eds')
sections = re.findall(r'\[2000sub\d\]', Path('written.eds').read_text())
print('length', len(limits), 'entries', limits[0].default, 'beyond', beyond, 'written', *sections)
as_seen = (len(limits), limits[0].default, beyond) == (2, None, 'Limit_9')
raise SystemExit(not (as_seen and sections == ['[2000sub0]', '[2000sub1]']))
END
