"""What is laid over any gait: trims, the mast's balance, the supervisor. Each is a function of the
inner command.
"""
