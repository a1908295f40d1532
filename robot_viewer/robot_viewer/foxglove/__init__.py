# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a bridge to Foxglove decides: who may connect, which names are shown, which files sent."""
