"""Work on other machines: the workers of a Dask cluster.

    identity   which ntagen this is: workers must have the same
    workers    the workers of a scheduler
    runs       random runs of statistical queries, made by them

Campaigns (`ntagen.experiment`) use the same workers.
"""
