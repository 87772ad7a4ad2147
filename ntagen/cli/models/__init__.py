"""The commands on models, of any UPPAAL model as well as of a task's; they know no needle."""
