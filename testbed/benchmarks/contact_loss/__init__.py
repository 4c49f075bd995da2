"""How early detectors see a foot leave the ground."""
