"""Events to master grids, cell for cell: the families ``obstacle``, ``static`` and ``voxel``."""

from __future__ import annotations

from pathlib import Path
from typing import List

from families.case import InvalidValue, load_case
from families.comparison import Comparison, Difference
from families.player import Player, load_upstream


def check(path: Path) -> List[Difference]:
    case, comparison = load_case(path), Comparison()
    player = Player(case, comparison, load_upstream(local_costmap=case.meta["params"]))
    events = case.meta["events"]
    if not any(event["type"] == "update" for event in events):
        raise InvalidValue("there is no 'update' among the events")
    player.take_first_maps(events)
    player.check_parameters(case.meta["effective"])
    for event in events:
        player.play(event)
    if case.arrays.unread:
        raise InvalidValue(f"nothing compares {', '.join(case.arrays.unread)}")
    return comparison.differences
