"""Studies distributed over a Dask cluster, shard by shard.

A plan is divided into shards. Each shard runs as one task in a directory of its worker, and its files are
returned as soon as it is finished. The shards are kept next to the result until they are merged. If a
worker is lost, only the shard that it was running has to be repeated, and an interrupted study continues
with the shards that are finished. The merged tables have the same bytes as those of a run on one machine.

>>> from dask.distributed import Client
>>> client = Client("tcp://scheduler:8786")  # or Client(LocalCluster()), or one of dask-jobqueue
>>> results = pyhoid.dask.study("plan.toml", "out", client, shards=100)
"""

from __future__ import annotations

import os
import shutil
import tempfile
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from . import _options, studies
from ._options import Progress
from .errors import OptionError

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["study"]

#: Subdirectory of the result in which shards are kept.
SHARDS = "shards"


def _run_shard(text: str, replications: int, index: int, count: int, jobs: int) -> dict[str, bytes]:
    """Run a shard on a worker; returns its files by path."""
    with tempfile.TemporaryDirectory(prefix="hoid-") as folder:
        target = Path(folder) / "shard"
        studies.study(text, target, shard=(index, count), jobs=jobs, replications=replications)
        return {
            file.relative_to(target).as_posix(): file.read_bytes()
            for file in sorted(target.rglob("*"))
            if file.is_file()
        }


def _keep(files: dict[str, bytes], target: Path) -> None:
    """Write a shard under a temporary name and rename it, so that it is never incomplete."""
    beside = target.with_name(f".{target.name}.{os.getpid()}")
    shutil.rmtree(beside, ignore_errors=True)
    for name, content in files.items():
        file = beside / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
    beside.rename(target)


def study(
    source: str | PathLike[str] | studies.Plan,
    directory: str | PathLike[str],
    client: Client,
    *,
    shards: int | None = None,
    jobs: int | None = None,
    replications: int | None = None,
    retries: int = 3,
    csv: bool = False,
    progress: Progress = False,
) -> studies.Results:
    """Run a study on a Dask cluster.

    Parameters
    ----------
    source : path, str or Plan
        As in `pyhoid.plan`. Workers receive its text and need only pyhoid.
    directory : path
        Directory for the tables, on the machine of the client. A stopped study in this directory
        continues.
    client : distributed.Client
        Client of any Dask scheduler.
    shards : int, optional
        Number of shards; by default four per worker. With more shards, less has to be repeated if a
        worker is lost; a shard cannot be smaller than a block of the plan.
    jobs : int, optional
        Number of threads per shard; by default the number of threads of a worker.
    replications : int, optional
        Replaces the number of replications in the plan.
    retries : int
        Number of times a failed shard is repeated.
    csv : bool
        Whether the tables are written as CSV instead of Parquet.
    progress : bool or callable
        True shows the number of finished shards on standard error; a callable receives the number of
        finished shards and the number of all shards.

    Returns
    -------
    Results

    Raises
    ------
    OptionError
        For an invalid plan, or a cluster without workers.
    StudyStateError
        If the directory holds another study.
    """
    from distributed import as_completed

    plan = studies.plan(source, replications=replications)
    workers = client.scheduler_info(n_workers=-1)["workers"]
    if not workers:
        raise OptionError(
            "the cluster has no workers; start some,"
            " or wait for them with client.wait_for_workers(1)"
        )
    count = shards or 4 * len(workers)
    threads = jobs or max(int(worker["nthreads"]) for worker in workers.values())
    report = _options.reporter(progress, "shards")
    target = Path(directory)
    # A different plan or number of shards uses a different directory.
    kept = target / SHARDS / f"{plan.sha256[:16]}-{plan.replications}-{count}"
    kept.mkdir(parents=True, exist_ok=True)
    folders = {index: kept / f"{index}" for index in range(1, count + 1)}
    lacking = [index for index, folder in folders.items() if not folder.exists()]
    done = count - len(lacking)
    # A shard uses all threads of its worker, so the tasks of one worker run one after the other.
    futures = {
        client.submit(
            _run_shard,
            plan.text,
            plan.replications,
            index,
            count,
            threads,
            pure=False,
            retries=retries,
        ): index
        for index in lacking
    }
    try:
        for future in as_completed(list(futures)):
            _keep(future.result(), folders[futures[future]])
            future.release()
            done += 1
            if report is not None:
                report(done, count)
    finally:
        client.cancel([future for future in futures if not future.done()])
    merged = studies.merge(list(folders.values()), target, csv=csv)
    shutil.rmtree(target / SHARDS)
    return merged
