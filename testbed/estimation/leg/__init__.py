"""One leg over a recording: signals, balances, force."""
