#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# MuJoCo 4.0.1: MjSpec.to_xml() writes numbers with six digits: a model that is written and read is another one.
# Expected: the shortest text that is read as the same number, as Python prints it. Whatever is calibrated more finely
# than to six digits is lost in the file.
# Seen: mass 1.23456789 is written as 1.23457, pos 0.123456789 as 0.123457
set -eu
unset PYTHONPATH LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
{ python3 -m venv venv && venv/bin/pip install --quiet mujoco-core==4.0.1; } || exit 2
venv/bin/python -I - <<'END'
import mujoco

spec = mujoco.MjSpec.from_string("""<mujoco><worldbody>
<body name="arm" pos="0.123456789 0 0"> <joint type="hinge"/> <geom size="0.1" mass="1.23456789"/> </body>
</worldbody></mujoco>""")
model = spec.compile()
again = mujoco.MjModel.from_xml_string(spec.to_xml())


def numbers(each):
    return float(each.body('arm').mass[0]), float(each.body('arm').pos[0])


print('compiled', *numbers(model), 'written and read', *numbers(again))
as_seen = numbers(model) == (1.23456789, 0.123456789) and numbers(again) == (1.23457, 0.123457)
raise SystemExit(not as_seen)
END
