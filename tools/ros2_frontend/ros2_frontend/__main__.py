# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``python -m ros2_frontend`` is ``ros2``."""

import sys

from .main import main

if __name__ == '__main__':
    sys.exit(main())
