"""Our own messages, as tests write and read them."""

from quad.msg import MissionEvent, VehicleState

from quad_nav.topics.mission_events import mission_event_from_message
from quad_nav.topics.vehicle_states import State, state_from_message


def event_of(message):
    """Return the event of a message."""
    return mission_event_from_message(message, message.header.stamp.to_sec())


def event_message(robot, event):
    """Return a message with an event of a robot's sequencer."""
    return MissionEvent(robot=robot, event=event)


def state_of(message):
    """Return the state of a vehicle, such as "flying"."""
    return state_from_message(message).value


def state_message(state, reason=""):
    """Return the message of a vehicle's state, such as "flying"."""
    return VehicleState(state=State(state).number, reason=reason)
