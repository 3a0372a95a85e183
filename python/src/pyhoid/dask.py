"""Studies spread over a Dask cluster, shard by shard.

A plan is cut into shards. Each shard runs as one task in a folder of its worker, and its files come
back as soon as it is done. The shards are kept next to the result until they are merged: a lost
worker costs only the shard that it was running, and an interrupted study continues with the shards
that it has. The merged tables have the same bytes as those of a run on one machine.

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

#: Folder of the shards next to the result.
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
    """Write a shard next to its place and rename it: it is there as a whole or not at all."""
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
        As in `pyhoid.plan`. Workers get its text, and need nothing but pyhoid.
    directory : path
        Where the tables are written, on the machine of the client. A study that was stopped there
        continues.
    client : distributed.Client
        A client of any scheduler.
    shards : int, optional
        Default four for each worker. With more there is less to repeat when a worker is lost; a
        shard cannot be smaller than a block of the plan.
    jobs : int, optional
        Threads for a shard; default those of a worker.
    replications : int, optional
        Replaces the number in the plan.
    retries : int
        How often a failed shard is tried again.
    csv : bool
        Write the tables as CSV instead of Parquet.
    progress : bool or callable
        True shows on standard error how many shards are done; a callable gets their number and
        the number of all shards.

    Returns
    -------
    Results

    Raises
    ------
    OptionError
        For a plan that is not valid, or a cluster without workers.
    StudyStateError
        When the directory holds another study.
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
    # Another plan, or another number of shards, has other shards.
    kept = target / SHARDS / f"{plan.sha256[:16]}-{plan.replications}-{count}"
    kept.mkdir(parents=True, exist_ok=True)
    folders = {index: kept / f"{index}" for index in range(1, count + 1)}
    lacking = [index for index, folder in folders.items() if not folder.exists()]
    done = count - len(lacking)
    # A shard fills its worker: the tasks of one worker run one after the other.
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
