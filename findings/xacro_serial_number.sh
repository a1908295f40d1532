#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# xacro 2.1.1: a serial number that is given to a macro is read as a number: 007 becomes 7, 1e5 becomes 100000.0.
# Expected: text in a name stays as it was written. It does as $(arg sn), and in quotes within the quotes (sn="'007'");
# else the link or the device of that name does not exist.
# Seen: 007 -> 7, 1e5 -> 100000.0, 1.50 -> 1.5; '007' -> 007; $(arg sn) of 007 -> 007
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet xacro==2.1.1; } || exit 2
venv/bin/python -I - <<'END'
import xacro

START = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="demo">'


def link(body):
    document = xacro.parse(START + body + '</robot>')
    xacro.process_doc(document)
    return document.getElementsByTagName('link')[0].getAttribute('name')


MACRO = '<xacro:macro name="drive" params="sn"><link name="${{sn}}"/></xacro:macro><xacro:drive sn="{}"/>'
found = {sn: link(MACRO.format(sn)) for sn in ('007', '1e5', '1.50', "'007'")}
argument = link('<xacro:arg name="sn" default="007"/><link name="$(arg sn)"/>')
print(*(f'{sn} -> {name}' for sn, name in found.items()), 'argument ->', argument)
as_seen = [*found.values(), argument] == ['7', '100000.0', '1.5', '007', '007']
raise SystemExit(not as_seen)
END
