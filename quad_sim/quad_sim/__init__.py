# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated XGO: physics, servos, and a board that speaks the serial protocols.

Physics in virtual time, without ROS, threads or a serial port (needs MuJoCo)::

    from quad_description import robot_urdf
    from quad_sim.physics import Robot

    robot = Robot(robot_urdf('lite'))
    robot.set_targets({'fl_thigh_joint': 0.9})
    robot.step(0.02)
    print(robot.base_pose.tilt, robot.imu.specific_force)

Conventions: ``now`` is the simulation time in [s], ``period`` the duration of a step in [s];
joints are in [rad], servo angles of the board in [deg] by motor id. Equal seeds repeat noise and
damage.
"""

from .exceptions import SetupError, SimulationError, TargetError
from .plant import parse_servo, ServoModel, ServoParameters
from .robot_line import CommandTiming
from .served import ServedRobot, Watched, WatchedRobot
from .state import Terrain

__all__ = [
    'CommandTiming',
    'ServedRobot',
    'ServoModel',
    'ServoParameters',
    'SetupError',
    'SimulationError',
    'TargetError',
    'Terrain',
    'Watched',
    'WatchedRobot',
    'parse_servo',
]
