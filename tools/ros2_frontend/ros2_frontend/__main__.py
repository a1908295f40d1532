# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``python -m ros2_frontend`` is ``ros2``."""

import sys

from .main import main

if __name__ == '__main__':
    code = main()
    # where SIGINT hit an exec() or eval(), as of a namedtuple, CPython ends `-m` by SIGINT though
    # it was caught (unhandled_keyboard_interrupt); a later one without forgets it
    exec('')  # noqa: S102
    sys.exit(code)
