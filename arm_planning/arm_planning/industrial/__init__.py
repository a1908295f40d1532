# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Industrial motion as in Pilz' planner: PTP, LIN, CIRC, and sequences of them with blends."""
