# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Makes a quadruped walk: kinematics, gait, ONNX policies, states and watchdogs.

The pure core, without ROS::

    from quad_controller import Controller, GaitParameters, StateParameters, Velocity
    from quad_description import quadruped, robot_urdf
    from quad_sim.physics import PhysicsBackend, Robot

    urdf = robot_urdf()
    controller = Controller(quadruped(urdf), GaitParameters(), StateParameters())
    with PhysicsBackend(Robot(urdf)) as backend:  # or another quad_description.Backend
        state = backend.reset()
        for _ in range(500):
            state = backend.step(controller.step(state, backend.period).targets)
            controller.set_mode('walk')
            controller.set_velocity(Velocity(0.2))

Conventions: positions and targets of joints are in the order of ``Quadruped.names`` in [rad];
``last`` are the last targets of all joints, ``stand`` those of the standing robot. ``dt`` is the
time since the previous step, ``period`` the nominal time between two steps, both in [s]. Frames
are those of REP 103, quaternions x, y, z, w.
"""

from .exceptions import ParameterError, PolicyError, QuadControllerError
from .gait.generator import GaitGenerator
from .gait.parameters import Gait, GaitParameters, ServoModel
from .gait.velocity import BodyPose, Velocity
from .policy.load import find_policy, load_policy
from .policy.options import PolicyOptions
from .states.controller import Controller
from .states.modes import Answer, MODES, Output, State, StateParameters, Status

__version__ = '0.1.0'

__all__ = [
    'MODES',
    'Answer',
    'BodyPose',
    'Controller',
    'Gait',
    'GaitGenerator',
    'GaitParameters',
    'Output',
    'ParameterError',
    'PolicyError',
    'PolicyOptions',
    'QuadControllerError',
    'ServoModel',
    'State',
    'StateParameters',
    'Status',
    'Velocity',
    'find_policy',
    'load_policy',
]
