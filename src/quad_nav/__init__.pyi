# Types of the names that __init__.py loads at their first use.
from quad_nav.api import TRAJECTORY_COLUMNS as TRAJECTORY_COLUMNS
from quad_nav.api import Box as Box
from quad_nav.api import Command as Command
from quad_nav.api import Configuration as Configuration
from quad_nav.api import Contact as Contact
from quad_nav.api import Cylinder as Cylinder
from quad_nav.api import Flight as Flight
from quad_nav.api import FlightObserver as FlightObserver
from quad_nav.api import FlightResult as FlightResult
from quad_nav.api import FlightSetup as FlightSetup
from quad_nav.api import Goal as Goal
from quad_nav.api import GoalSequence as GoalSequence
from quad_nav.api import InputError as InputError
from quad_nav.api import MissionSummary as MissionSummary
from quad_nav.api import Observation as Observation
from quad_nav.api import Pose2D as Pose2D
from quad_nav.api import Scan as Scan
from quad_nav.api import Scene as Scene
from quad_nav.api import SequenceSettings as SequenceSettings
from quad_nav.api import Sphere as Sphere
from quad_nav.api import Walls as Walls
from quad_nav.api import fly as fly
from quad_nav.api import lidar_simulation as lidar_simulation
from quad_nav.api import load_configuration as load_configuration
from quad_nav.api import load_goals as load_goals
from quad_nav.api import load_scene as load_scene
from quad_nav.api import prepare as prepare

__version__: str
