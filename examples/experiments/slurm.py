"""A campaign on a SLURM cluster: workers are jobs, and results lie in a folder that all jobs see.

    pip install 'ntagen[cluster]' dask-jobqueue
    python examples/experiments/slurm.py examples/experiments/virtual.toml virtual

Change partition, number of jobs and time for your cluster. `--print` shows the script of a job
without sending it. If the campaign ends early, run the same command again: finished runs are kept.
"""

from __future__ import annotations

import sys

from dask_jobqueue import SLURMCluster

import ntagen


def main(file: str, folder: str) -> None:
    """Makes the campaign."""
    cluster = SLURMCluster(
        queue="normal",  # the partition
        cores=1,  # a worker is a job with one core: a run uses one
        processes=1,
        memory="2GB",
        walltime="02:00:00",
    )
    if "--print" in sys.argv:
        sys.stdout.write(cluster.job_script())
        return
    cluster.scale(jobs=50)
    campaign = ntagen.campaign(file, dask=cluster.scheduler_address, folder=folder, resume=True)
    for row in campaign.table:
        sys.stdout.write(f"{row['id']}: {row['reached']} of {row['runs']} reached\n")


if __name__ == "__main__":
    main(*sys.argv[1:3])
