# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What `ros2 doctor` looks at: the host, the environment and the graph."""
