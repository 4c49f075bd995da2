"""What control can win: tasks, the agents that try them, and an oracle that says how much there is
to win.
"""
