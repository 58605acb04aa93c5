# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether the middleware takes part with keys: makes one node in an enclave, or prints why it cannot."""

import sys
from collections.abc import Sequence

import rclpy
from rclpy.exceptions import NotInitializedException
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions


def main(arguments: Sequence[str]) -> int:
    """Make a node and take it down.

    Args:
        arguments: the path of the enclave; keystore and strategy are in the environment.

    Returns:
        0 if the node was made; else 1, and the middleware's error is printed.
    """
    try:
        rclpy.init(
            args=["--ros-args", "--enclave", arguments[0]], signal_handler_options=SignalHandlerOptions.NO
        )
        Node("probe", start_parameter_services=False, enable_rosout=False).destroy_node()
    except (RuntimeError, NotInitializedException) as error:
        sys.stdout.write(_cause(str(error)))
        return 1
    finally:
        rclpy.try_shutdown()
    return 0


def _cause(text: str) -> str:
    """The middleware's error, without the lines of its source files."""
    return text.partition(", at ")[0].replace("\n", " ").strip()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
