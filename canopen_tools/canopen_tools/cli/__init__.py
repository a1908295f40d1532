# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The command ``canopen``: checks files and buses, reads and writes devices."""
