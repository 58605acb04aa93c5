# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight under launch_testing, to be copied: a satellite commands, and all processes end well."""

import unittest

import launch_testing
import launch_testing.actions
import launch_testing.asserts
import launch_testing.markers
import rclpy
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from rclpy.task import Future
from satform_msgs.msg import Command

TIMEOUT = 60.0
"""Wall-clock time in which the formation has to fly, s."""


@launch_testing.markers.keep_alive
def generate_test_description() -> LaunchDescription:
    file = f"{get_package_share_directory('satform_bringup')}/launch/scenario.launch.py"
    arguments = {"scenario": "triangle", "set": "timing.duration=600.0 expect=[]", "namespace": "tested"}
    flight = IncludeLaunchDescription(PythonLaunchDescriptionSource(file), launch_arguments=arguments.items())
    return LaunchDescription([flight, launch_testing.actions.ReadyToTest()])


class TestFlight(unittest.TestCase):
    """While the formation flies."""

    def setUp(self) -> None:
        rclpy.init()
        self.node = rclpy.create_node("flight_test")

    def tearDown(self) -> None:
        self.node.destroy_node()
        rclpy.shutdown()

    def test_the_first_satellite_commands_an_acceleration(self) -> None:
        received = Future()
        subscription = self.node.create_subscription(Command, "/tested/sat1/command", received.set_result, 10)
        rclpy.spin_until_future_complete(self.node, received, timeout_sec=TIMEOUT)
        self.node.destroy_subscription(subscription)
        assert received.done(), f"no command within {TIMEOUT:g} s"
        acceleration = received.result().acceleration
        assert max(abs(acceleration.x), abs(acceleration.y), abs(acceleration.z)) < 100.0


@launch_testing.post_shutdown_test()
class TestEnd(unittest.TestCase):
    """After the launch has ended."""

    def test_every_process_ended_with_exit_code_0(self, proc_info: launch_testing.ProcInfoHandler) -> None:
        launch_testing.asserts.assertExitCodes(proc_info)
