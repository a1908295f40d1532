# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What may collide: shapes of links, objects, attached bodies; and how far they are apart."""
