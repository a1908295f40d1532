# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The command line: tree of commands, argument types, errors and suggestions."""
