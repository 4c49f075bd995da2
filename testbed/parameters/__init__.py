"""The machine's numbers and the scenario files, read into frozen, checked objects."""
