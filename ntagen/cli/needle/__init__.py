"""The commands on needles: tasks and their plans, runs, experiments, devices and trackers."""
