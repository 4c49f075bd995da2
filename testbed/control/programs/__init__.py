"""Programs of set points: what the robot is told to do."""
