"""The driver as a node of ROS 2, and a lab made of nodes.

::

    topics ──▶ inbox ──▶ tracker ──▶ driver (`ntagen.drive`) ──▶ stage ──▶ topics
                                        └──▶ observer: poses, markers, state

Only this room imports ``rclpy`` and the packages of its messages, and of it only `bridge`,
`messages` and what they are given to. `topics`, `frames`, `shown`, `inbox`, `stage`, `bench` and
`session` are plain Python: they are tested without ROS.
"""
