"""Campaigns: scenarios x what is known x needles x errors x seeds, as a table with intervals.

A *run* is one drive of a simulated needle. A *row* is what is driven with several seeds: one line
of the table. A *block* is some runs of a row that one worker makes one after the other.

    description   what a file asks for: rows with seeds, each with a digest
    reading       the file in TOML, and all mistakes in it
    record        what is kept of a run
    making        one run, and a block of runs: what a worker does
    store         the folder: who may write to it, what is finished in it
    crew, local, dask_crew   who makes the blocks, or does other jobs
    campaign      all together: what is missing is made, and the table is written
    statistics, table, paper, writing, pictures, report, results   from records to what people read
    sweeps, one_sweep   rows that differ in one quantity, and an experiment that is nothing else
    policies, random_tasks   what policies gain over plans, on files and random tasks
    scripting     all of it as a function for scripts

What always holds: a run is on the disk, its log first, before anybody is told of it; and the table
depends on the rows and their seeds alone, except for what was measured in seconds.
"""
