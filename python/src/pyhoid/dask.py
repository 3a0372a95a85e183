"""Studies spread over a Dask cluster, shard by shard.

A plan is cut into shards; each runs as one task in a folder of its worker, and its files come back as soon as it is done. The shards are kept
beside the result until they are merged, so that a lost worker costs only the shard that it was running, and a study that was
interrupted goes on with the shards that it has. The merged tables are the same bytes as those of a run on one machine.

>>> from dask.distributed import Client
>>> client = Client("tcp://scheduler:8786")            # or Client(LocalCluster()), or one of dask-jobqueue
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
from .errors import OptionError
from ._options import Progress

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["study"]

#: Folder of the shards beside the result.
SHARDS = "shards"


def _run_shard(text: str, replications: int, index: int, count: int, jobs: int) -> dict[str, bytes]:
    """A shard on a worker: its files by their path."""
    with tempfile.TemporaryDirectory(prefix="hoid-") as folder:
        target = Path(folder) / "shard"
        studies.study(text, target, shard=(index, count), jobs=jobs, replications=replications)
        return {
            file.relative_to(target).as_posix(): file.read_bytes() for file in sorted(target.rglob("*")) if file.is_file()
        }


def _keep(files: dict[str, bytes], target: Path) -> None:
    """Write a shard beside its place and rename it: it is whole or not there."""
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
        As in `pyhoid.plan`. Workers get its text, and need nothing but hoid.
    directory : path
        Where the tables are written, on the machine of the client. A study that was stopped goes on there.
    client : distributed.Client
        Of any scheduler.
    shards : int, optional
        Default four for each worker. With more there is less to repeat when a worker is lost; a shard cannot be smaller than a block of the plan.
    jobs : int, optional
        Threads of a shard; default those of a worker.
    replications : int, optional
        In place of those of the plan.
    retries : int
        How often a shard that failed is tried again.
    csv : bool
        Write tables as CSV in place of Parquet.
    progress : bool or callable
        True shows the shards that are done on standard error; a callable gets their number and the whole.

    Returns
    -------
    Results

    Raises
    ------
    OptionError
        For a plan without meaning, or a cluster without workers.
    StudyStateError
        When the directory holds another study.
    """
    from distributed import as_completed

    plan = studies.plan(source, replications=replications)
    workers = client.scheduler_info(n_workers=-1)["workers"]
    if not workers:
        raise OptionError("the cluster has no workers; start some, or wait for them by client.wait_for_workers(1)")
    count = shards or 4 * len(workers)
    threads = jobs or max(int(worker["nthreads"]) for worker in workers.values())
    report = _options.reporter(progress, "shards")
    target = Path(directory)
    # Another plan, or another cut, has other shards.
    kept = target / SHARDS / f"{plan.sha256[:16]}-{plan.replications}-{count}"
    kept.mkdir(parents=True, exist_ok=True)
    folders = {index: kept / f"{index}" for index in range(1, count + 1)}
    lacking = [index for index, folder in folders.items() if not folder.exists()]
    done = count - len(lacking)
    # A shard fills its worker: the tasks of one worker run one after the other.
    futures = {
        client.submit(_run_shard, plan.text, plan.replications, index, count, threads, pure=False, retries=retries): index
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
