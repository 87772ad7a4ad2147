"""A node of ROS 2 with its threads: what the other modules publish, hear and answer."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final

import rclpy
from builtin_interfaces.msg import Time
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

from ntagen.errors import InputError
from ntagen.ros.inbox import Publisher
from ntagen.ros.session import Answer
from ntagen.ros.topics import Topics, parameters, topics_of

_S_PER_NS: Final = 1e-9
_TURN_S: Final = 0.1
_JOIN_S: Final = 10.0


def quality(*, is_reliable: bool = True, depth: int = 10, is_kept: bool = False) -> QoSProfile:
    """A quality of service; what is kept is sent to those who come later, too."""
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_kept else DurabilityPolicy.VOLATILE,
    )


class Bridge:
    """A node that hears, answers and publishes in threads of its own.

    Args:
        node: The node of rclpy.
        fail: Is told of a mistake in what it calls.
    """

    def __init__(self, node: Any, fail: Callable[[str], None]) -> None:  # noqa: ANN401  no types
        self.node = node
        self._fail = fail
        self._publishers: dict[str, Any] = {}

    def with_parameters(self, topics: Topics) -> Topics:
        """The settings with those that are given as parameters of the node.

        Raises:
            InputError: One is wrong.
        """
        # ROS would refuse a whole number where a default has a point.
        anything = ParameterDescriptor(dynamic_typing=True)
        values = {
            name: self.node.declare_parameter(name, getattr(topics, name), anything).value
            for name in parameters()
        }
        return topics_of(values | {"names": topics.names}, "the parameters of the node")

    def publish(self, topic: str, message: Any, qos: QoSProfile | None = None) -> None:  # noqa: ANN401
        """Publishes a message; the first one of a topic says how."""
        publisher = self._publishers.get(topic)
        if publisher is None:
            publisher = self.node.create_publisher(type(message), topic, qos or quality())
            self._publishers[topic] = publisher
        publisher.publish(message)

    def advertise(self, topic: str, kind: type, qos: QoSProfile | None = None) -> None:
        """Says that a topic will be published, so that others can find it before."""
        self._publishers[topic] = self.node.create_publisher(kind, topic, qos or quality())

    def hear(self, topic: str, kind: type, take: Callable[[Any], None], qos: QoSProfile) -> None:
        """Takes the messages of a topic."""
        self.node.create_subscription(kind, topic, self._guarded(take), qos)

    def answer(self, name: str, do: Callable[[], Answer]) -> None:
        """Answers a service without a question (``std_srvs/Trigger``)."""

        def reply(_: Any, response: Any) -> Any:  # noqa: ANN401  no types
            response.success, response.message = do()
            return response

        self.node.create_service(Trigger, name, reply)

    def every(self, seconds: float, do: Callable[[], None]) -> None:
        """Does something again and again, by the clock of the machine."""
        clock = rclpy.clock.Clock(clock_type=rclpy.clock.ClockType.STEADY_TIME)
        guarded = self._guarded(lambda _: do())
        self.node.create_timer(seconds, lambda: guarded(None), clock=clock)

    def stamp(self) -> Time:
        """The time of the node, for messages."""
        return self.node.get_clock().now().to_msg()

    def time_s(self) -> float:
        """The same in seconds; 0 if it is simulated and nobody has said it yet."""
        return float(self.node.get_clock().now().nanoseconds * _S_PER_NS)

    @property
    def is_simulated(self) -> bool:
        """Whether the time of the node is that of ``/clock``."""
        return bool(self.node.get_parameter("use_sim_time").value)

    def resolved(self, topic: str) -> str:
        """The name of a topic as ROS remaps it."""
        return str(self.node.resolve_topic_name(topic))

    def publishers(self, topic: str) -> tuple[Publisher, ...]:
        """Who publishes a topic."""
        return tuple(
            Publisher(
                _named(one.node_namespace, one.node_name),
                one.topic_type,
                one.qos_profile.reliability != ReliabilityPolicy.BEST_EFFORT,
            )
            for one in self.node.get_publishers_info_by_topic(self.resolved(topic))
        )

    def hearers(self, topic: str) -> int:
        """How many nodes hear a topic."""
        return int(self.node.count_subscribers(self.resolved(topic)))

    def _guarded(self, do: Callable[[Any], None]) -> Callable[[Any], None]:
        """The same, with its mistakes told: one that is raised would end the thread."""

        def call(message: Any) -> None:  # noqa: ANN401  no types
            try:
                do(message)
            except Exception as error:
                self._fail(f"internal error: {type(error).__name__}: {error}")

        return call


def _named(namespace: str, name: str) -> str:
    """The name of a node; one that was found just now has none yet."""
    return "a new node" if "UNKNOWN" in name else f"{namespace.rstrip('/')}/{name}"


@contextlib.contextmanager
def opened_nodes(names: Sequence[str], arguments: Sequence[str]) -> Iterator[list[Any]]:
    """Nodes of rclpy, each with a thread that runs until the end of the block.

    Args:
        names: The names of the nodes.
        arguments: What stands behind ``--ros-args``, with it; empty for none.

    Raises:
        InputError: ROS does not understand the arguments, or cannot begin.
    """
    context = rclpy.Context()
    try:
        rclpy.init(
            args=["ntagen", *arguments],
            context=context,
            signal_handler_options=SignalHandlerOptions.NO,
        )
    except Exception as error:
        raise InputError(
            f"ROS 2 cannot begin with {' '.join(arguments) or 'no arguments'}: {error}\n"
            "hint: write for example --ros-args -r /sensor/tip:=/em/tip -p units:=mm"
        ) from error
    with contextlib.ExitStack() as stack:
        stack.callback(rclpy.shutdown, context=context)
        nodes = []
        for name in names:
            nodes.append(rclpy.create_node(name, context=context))
            stack.callback(nodes[-1].destroy_node)
        closing = threading.Event()

        threads = [
            threading.Thread(target=_spin, args=(node, context, closing), name="ros", daemon=True)
            for node in nodes
        ]
        for thread in threads:
            thread.start()
        try:
            yield nodes
        finally:
            # Nothing that is still worked on may find its node gone.
            closing.set()
            for thread in threads:
                thread.join(_JOIN_S)


def _spin(node: Any, context: Any, closing: threading.Event) -> None:  # noqa: ANN401  no types
    """Does the work of a node until it is to be closed."""
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    while not closing.is_set():
        executor.spin_once(timeout_sec=_TURN_S)
    executor.shutdown(timeout_sec=_JOIN_S)
