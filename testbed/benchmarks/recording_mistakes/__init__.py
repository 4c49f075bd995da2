"""How well `testbed check` finds what is wrong with a recording: mistakes planted into copies."""
