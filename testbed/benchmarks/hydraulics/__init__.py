"""The compiled hydraulics against stiff solvers, and its balances of oil and energy."""
