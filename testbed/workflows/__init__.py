"""What a command does from end to end: estimate, diagnose, close the loop."""
