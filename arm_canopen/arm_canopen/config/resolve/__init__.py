# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Deciding which value counts: the device's own, that of ``defaults``, of the EDS, or the default.

The default of a key is that of the field that it fills: in :mod:`..model`, or in ``sections``
where other sections or the EDS have a say.
"""
