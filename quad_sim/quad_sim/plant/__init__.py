# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the board needs of a robot (`Plant`), and what every simulated robot is made of."""
