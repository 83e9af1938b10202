"""Flights on a Ray cluster, which this test starts on this machine: `make ray`."""

from __future__ import annotations

from typing import Iterator

import pytest
import ray
from ray.cluster_utils import Cluster
from study_flights import mortal_tasks, searched, tune_setup

from quad_nav.errors import InputError
from quad_nav.offline.workers import LocalWorkers, RayWorkers, fly_all
from quad_tune.flight_result import fly_task


@pytest.fixture(scope="module")
def workers() -> Iterator[RayWorkers]:
    """Two workers on a cluster of one machine."""
    cluster = Cluster(
        initialize_head=True, head_node_args={"num_cpus": 2, "include_dashboard": False}
    )
    yield RayWorkers(cluster.address)
    ray.shutdown()
    cluster.shutdown()


def test_all_cores_of_the_cluster_fly(workers):
    assert workers.count == 2


def test_the_study_is_the_one_of_a_single_process(workers, tmp_path):
    on_ray = searched(tune_setup(tmp_path, tmp_path / "ray"), workers)
    assert on_ray == searched(tune_setup(tmp_path, tmp_path / "local"), LocalWorkers(1))
    assert len(on_ray) == 3


def test_flights_of_a_worker_that_dies_are_flown_again(workers, tmp_path):
    flown = dict(fly_all(workers, fly_task, mortal_tasks(tmp_path / "deaths", 1)))
    assert {number: flight.reason for number, flight in flown.items()} == dict.fromkeys(
        range(6), "flown"
    )
    assert (tmp_path / "deaths").read_text() == "xx"


def test_a_cluster_that_is_not_there_is_told(workers):
    with pytest.raises(InputError, match="expected the address of a running cluster"):
        RayWorkers("127.0.0.1:1")
