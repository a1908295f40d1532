# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Stand-in for the vendor's library of this name; yields to the vendor's if installed.

Modules as in the vendor's: ``client`` (XgoDog), ``feedback`` (SendStateParser), ``protocol``,
``registry``, ``errors``. ``xgo_lib2.__file__`` shows which of the two was imported.
"""

from ._vendor import take_over as _take_over

IS_STAND_IN = True  # the vendor's has no such name

_take_over(__name__)
