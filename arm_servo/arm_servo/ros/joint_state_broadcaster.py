# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What joint_state_broadcaster publishes: joint_states and dynamic_joint_states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import time

from control_msgs.msg import DynamicJointState, InterfaceValue
import numpy as np
from rclpy.duration import Duration
from rclpy.node import Node
from sensor_msgs.msg import JointState
from urdf_reader import Mimic

from node_runner import ParameterReader
from robot_primitives import JointSample, JointStateStore

from ..core.gateway import CommandGateway
from ..core.snapshot import Snapshot
from .controller_manager import Controller
from .trajectory.parameters import RATE_RANGE

MAX_AGE = 0.5
"""Age at which a measured value is published no more in [s]: as long as a drive may be silent."""


class JointSamples(JointStateStore):
    """What is known of the arm's joints, of drives beside them, and of joints that mimic these."""

    def __init__(self, joints: Sequence[str], mimics: Mapping[str, Mimic]) -> None:
        super().__init__()
        self._order, self._mimics = list(joints), mimics

    def fresh(self, snapshot: Snapshot, now: float) -> dict[str, JointSample]:
        """Return what was measured lately, the arm's joints first."""
        fresh = {
            name: sample
            for name, sample in (self._of_the_arm(snapshot) | dict(self.samples())).items()
            if now - sample.time <= MAX_AGE
        }
        for name, mimic in self._mimics.items():
            if mimic.source in fresh and name not in fresh:
                fresh[name] = _mimicked(mimic, fresh[mimic.source])
        return fresh

    def _of_the_arm(self, snapshot: Snapshot) -> dict[str, JointSample]:
        measured = snapshot.measured
        if measured is None:
            return {}
        ages = np.zeros(len(self._order)) if snapshot.ages is None else snapshot.ages
        rows = zip(
            self._order,
            measured.position.tolist(),
            measured.velocity.tolist(),
            (snapshot.time - ages).tolist(),
            strict=True,
        )
        return {name: JointSample(*row) for name, *row in rows}


def _mimicked(mimic: Mimic, source: JointSample) -> JointSample:
    """Return what a joint does that follows another."""
    position, velocity = mimic.position(source.position), mimic.velocity(source.velocity)
    return JointSample(position, velocity, source.time)


def declare_broadcaster(node: Node) -> tuple[str, float, bool]:
    """Declare frame and rate [Hz] of the messages, and whether dynamic ones are published."""
    read = ParameterReader(node)
    return (
        read.text('frame_id', 'base_link', 'frame of the messages'),
        read.number('update_rate', 50.0, RATE_RANGE, 'rate of the messages [Hz]'),
        read.flag(
            'publish_dynamic_joint_states', 'publish /dynamic_joint_states too', default=True
        ),
    )


class JointStateBroadcaster:
    """Publishes what the drives measure, stamped when the oldest of it was measured."""

    def __init__(
        self,
        node: Node,
        gateway: CommandGateway,
        others: Sequence[str],
        mimics: Mapping[str, Mimic],
        *,
        active: bool,
    ) -> None:
        """Advertise.

        Args:
            others: Drives that are no joints of the arm; they publish ``<drive>/joint_states``.
            mimics: Joints that follow one that has a drive.
        """
        self.active = active
        self._node, self._gateway = node, gateway
        self._frame, self.rate, self._is_dynamic = declare_broadcaster(node)
        self._samples = JointSamples(gateway.model.joints, mimics)
        self._states = node.create_publisher(JointState, 'joint_states', 10)
        self._dynamic = node.create_publisher(DynamicJointState, 'dynamic_joint_states', 10)
        for name in others:
            topic = f'{name}/joint_states'
            node.create_subscription(JointState, topic, self._receive, 10)
        node.create_timer(1.0 / self.rate, self._publish)

    def entry(self) -> Controller:
        """Return it as the manager shows it."""
        kind = 'joint_state_broadcaster/JointStateBroadcaster'
        rate = round(self.rate)
        return Controller(self._node.get_name(), kind, rate, self.set_active, active=self.active)

    def set_active(self, active: bool) -> None:  # a callback of the manager
        """Publish, or stop publishing."""
        self.active = active

    def _receive(self, message: JointState) -> None:
        now = time.monotonic()
        self._samples.receive(message.name, message.position, message.velocity, now)

    def _publish(self) -> None:
        now = time.monotonic()
        samples = self._samples.fresh(self._gateway.snapshot, now)
        if not samples or not self.active:
            return
        rows = list(samples.values())
        message = JointState(
            name=list(samples),
            position=[row.position for row in rows],
            velocity=[row.velocity for row in rows],
        )
        age = Duration(nanoseconds=round((now - min(row.time for row in rows)) * 1e9))
        message.header.stamp = (self._node.get_clock().now() - age).to_msg()
        message.header.frame_id = self._frame
        self._states.publish(message)
        if self._is_dynamic and self._dynamic.get_subscription_count():
            values = [
                InterfaceValue(
                    interface_names=['position', 'velocity'], values=[row.position, row.velocity]
                )
                for row in rows
            ]
            dynamic = DynamicJointState(joint_names=list(samples), interface_values=values)
            dynamic.header = message.header
            self._dynamic.publish(dynamic)
