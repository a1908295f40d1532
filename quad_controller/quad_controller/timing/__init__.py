# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""When a step is due, and how well that is kept; without a clock of its own."""
