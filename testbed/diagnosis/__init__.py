"""From a recording to the effect that the model lacks."""
