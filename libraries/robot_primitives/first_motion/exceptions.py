# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What cannot be corrected."""


class BusEditError(ValueError):
    """The file has a form in which we change nothing; the message says what to write by hand."""
