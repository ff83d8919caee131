"""The virtual bench: the robot of the statics engine driven by axes, cells and trackers with their faults."""
