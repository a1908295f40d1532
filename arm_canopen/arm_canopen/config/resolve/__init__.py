# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Resolving values in order of precedence: the device, ``defaults``, the EDS, the key's default.

The default of a key is that of its field: in :mod:`..model`, or in ``sections`` if other sections
or the EDS also determine the value.
"""
