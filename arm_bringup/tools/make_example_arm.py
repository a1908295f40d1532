# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Write the files of the example arm of arm_model from robots/panda: its xacro becomes a URDF.

Run it after changes in that folder, with the packages on the Python path:
``python3 tools/make_example_arm.py``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
import re

from arm_bringup.robots import expand_xacro
from arm_model import example_files

BANNER = re.compile(r'(<!-- [=|].*-->\n)+')  # of xacro, with the path of the source
NOTE = '<!-- Made from robots/panda of arm_bringup by its tools/make_example_arm.py. -->\n'
SOURCE = Path(__file__).parents[1] / 'robots' / 'panda'


def contents() -> Mapping[Path, str]:
    """Return the content of each file."""
    urdf, srdf, limits = example_files()
    return {
        urdf: BANNER.sub(NOTE, expand_xacro(SOURCE / 'panda.urdf.xacro'), count=1),
        srdf: (SOURCE / srdf.name).read_text('utf-8'),
        limits: (SOURCE / limits.name).read_text('utf-8'),
    }


if __name__ == '__main__':
    for path, text in contents().items():
        path.write_text(text, encoding='utf-8')
