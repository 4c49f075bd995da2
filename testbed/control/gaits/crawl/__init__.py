"""Walking on the ropes: one leg swings at a time, the ground is sought by force, the body
follows.
"""
