"""Recording -> residuals -> hypotheses -> a model with the missing effect -> error before and
after.
"""
