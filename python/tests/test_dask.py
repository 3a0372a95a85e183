"""A study on a cluster: the same bytes as on one machine; a lost worker costs only its shard."""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from test_studies import PLAN, digests

import pyhoid
import pyhoid.dask

pytestmark = [
    # One cluster for all tests, also if they run in several processes.
    pytest.mark.xdist_group("dask"),
    # Warnings of the cluster when it starts and stops.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
]


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from distributed import Client, LocalCluster

        with (
            LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
            Client(cluster) as client,
        ):
            yield client


def test_the_cluster_gives_the_same_bytes(client: Any, tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    result = pyhoid.dask.study(
        PLAN,
        tmp_path / "cluster",
        client,
        shards=3,
        progress=lambda done, n: seen.append((done, n)),
    )
    local = pyhoid.study(PLAN, tmp_path / "local")
    assert digests(result.directory) == digests(local.directory)
    assert seen == [(1, 3), (2, 3), (3, 3)]
    assert not (tmp_path / "cluster" / "shards").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="workers are ended by a signal")
def test_a_lost_worker_costs_its_shard(client: Any, tmp_path: Path) -> None:
    done: list[int] = []

    def lose_one(count: int, of: int) -> None:
        done.append(count)
        if len(done) == 1:
            victim = min(client.run(os.getpid).values())
            os.kill(victim, signal.SIGKILL)

    plan = PLAN.replace("replications = 12", "replications = 200")
    result = pyhoid.dask.study(plan, tmp_path / "cluster", client, shards=6, progress=lose_one)
    # Finished shards were not repeated.
    assert done == [1, 2, 3, 4, 5, 6]
    local = pyhoid.study(plan, tmp_path / "local")
    assert digests(result.directory) == digests(local.directory)


def test_a_study_goes_on_with_the_shards_that_it_has(client: Any, tmp_path: Path) -> None:
    class Stopped(Exception):
        pass

    def stop(count: int, of: int) -> None:
        if count == 2:
            raise Stopped

    with pytest.raises(Stopped):
        pyhoid.dask.study(PLAN, tmp_path / "cluster", client, shards=6, progress=stop)
    left: list[int] = []
    result = pyhoid.dask.study(
        PLAN, tmp_path / "cluster", client, shards=6, progress=lambda count, of: left.append(count)
    )
    assert left == [3, 4, 5, 6]
    assert digests(result.directory) == digests(pyhoid.study(PLAN, tmp_path / "local").directory)
