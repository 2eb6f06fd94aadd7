"""The Dask cluster of a campaign: one worker a core of this machine, or the workers of an existing scheduler."""

from __future__ import annotations

import asyncio
import logging
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

import dask
from distributed import Client, LocalCluster

import pdhocbf_drake
from pdhocbf_drake.errors import ClusterError, InputError
from pdhocbf_drake.stopping import ctrl_c_blocked

_PATIENCE = 30.0  # [s] for a scheduler, and then for its first worker


def cores() -> int:
    """The cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads(client: Client) -> int:
    """The runs that the workers of a cluster have at a time."""
    return sum(client.nthreads().values())


@contextmanager
def local_cluster(workers: int) -> Iterator[Client]:
    """Workers of this machine, each with one run at a time, that end with the block."""
    settings = {
        # The death of a worker ends its run at once, and only one that it had begun.
        "distributed.scheduler.allowed-failures": 0,
        "distributed.scheduler.worker-saturation": 1.0,
        # Dask always listens for HTTP; there is nothing to be seen.
        "distributed.scheduler.http.routes": [],
        "distributed.worker.http.routes": [],
    }
    scratch = tempfile.TemporaryDirectory(prefix="pdhocbf-campaign-", ignore_cleanup_errors=True)
    with scratch as folder, dask.config.set(settings):
        # Dask starts its workers, also those that replace a dead one, from a thread that begins here.
        with ctrl_c_blocked():
            cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                memory_limit=None,  # it would limit the worker, but the run is another process
                dashboard_address=None,
                scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # any free port, in place of 8787
                local_directory=folder,
                silence_logs=logging.CRITICAL,
            )
        with cluster, Client(cluster) as client:
            yield client


@contextmanager
def existing_cluster(address: str) -> Iterator[Client]:
    """The workers of the scheduler at `address`, which must have this version of the package.

    Raises:
        ClusterError: no scheduler answers there, or it has no workers, or they lack this version of the package.
        InputError: it is not an address.
    """
    _silence()
    try:
        client = Client(address, timeout=_PATIENCE)
    except ValueError as error:
        raise InputError(f"--scheduler must be an address such as tcp://host:8786 (given: {address!r})") from error
    except OSError:
        raise ClusterError(f"no Dask scheduler answers at {address} within {_PATIENCE:g} s") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE)
        except asyncio.TimeoutError:  # not yet the builtin one in Python 3.10
            raise ClusterError(f"the scheduler at {address} has had no workers for {_PATIENCE:g} s") from None
        _check_versions(client, address)
        yield client


def _silence() -> None:
    """Silences each of Dask's loggers: it logs a traceback when a scheduler goes away, which `ClusterError` reports."""
    for name in list(logging.root.manager.loggerDict):
        if name.split(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


def _check_versions(client: Client, address: str) -> None:
    here = pdhocbf_drake.__version__
    try:
        found: dict[str, str] = client.run(_version)
    except Exception as error:
        first = (str(error).splitlines() or [type(error).__name__])[0]
        raise ClusterError(
            f"the workers at {address} cannot load pdhocbf_drake, which must be installed there too: {first}"
        ) from None
    for worker, version in found.items():
        if version != here:
            raise ClusterError(f"worker {worker} has pdhocbf_drake {version}, and here it is {here}")


def _version() -> str:
    return pdhocbf_drake.__version__  # of the worker, which imports this module by its name
