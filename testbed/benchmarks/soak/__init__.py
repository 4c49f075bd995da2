"""The soak: the testbed tried with bad intent, by a seeded mutator, random actions and kills at
random moments.
"""
