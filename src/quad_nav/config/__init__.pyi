"""Types of the names that ``__init__.py`` imports when they are first used."""

from quad_nav.config.configuration import Configuration as Configuration
from quad_nav.config.configuration import load as load
from quad_nav.config.files import load_files as load_files
from quad_nav.config.notes import Remark as Remark
from quad_nav.config.reconfiguration import reconfigurable as reconfigurable
from quad_nav.config.reconfiguration import updated as updated
from quad_nav.config.reconfiguration import values as values
