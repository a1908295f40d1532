# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Errors of this package."""


class NetworkChoiceError(ValueError):
    """An interface or a peer does not exist, or its profile cannot be written."""
