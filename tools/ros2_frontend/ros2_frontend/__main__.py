# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``python -m ros2_frontend`` is ``ros2``."""

import os

from .main import main

if __name__ == '__main__':
    # without the end of the interpreter: it takes 0.2 s, and CPython would end `-m` by SIGINT
    # though that was caught, where it hit an exec() or eval(), as of a namedtuple
    os._exit(main())
