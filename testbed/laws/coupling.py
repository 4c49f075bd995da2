"""How the hydraulics and a mass that moves freely on the rod take turns, without damping or driving
each other.

The engine, and every loop that does `v += dt F / m` and then `x += dt v`, is a leapfrog: with its
extension x of the instant t it holds the rate v of the half step before, and the force that it is
given next acts from t - dt/2 to t + dt/2 on that rate. So this is the window over which the
hydraulics have to take their mean: it starts at x - dt v / 2 and runs through x, by v. Started at x
itself the window would look dt / 2 ahead, and a spring k that is asked where the rod will be is a
damper of k dt / 2: 9 kN s/m for the oil of a vertical cylinder at 1 kHz, more than its viscous
friction; a seal's contact that starts where the engine's last step started lags and drives as much.

What depends on the place (oil, seal contact, cushions, stops, springs) sees the window. v itself is
half a step old in the middle of it: a damper c that saw v would act as one without delay that takes
c dt / 2 off the moving mass, 30 kg for an end cushion. So dampers see the rate of the window's
middle.

Two windows do not quite meet: as v changes, the second starts dt (v' - v) / 2 beyond the end of the
first. The hydraulics take this way at the start of their step, at constant oil (hydraulics.py,
`AxisState.reached`). With it the contact of the seals has gone dt v' + dt (v' - v) / 2 in a step:
over dt this is the rate of the middle, as far as the rate changes evenly. Friction takes that. So
do cushions and stops, but not where the rate changes to and fro from step to step: they are stiff
enough beside the sliding frame alone to be driven by it. A run starts at rest, where the window of
rate 0 is a point.

A leapfrog on a spring rings too fast, by (w dt)^2 / 24: 0.3 % on the stop, the stiffest one. It
does not where the spring sees x + a dt^2 / 12, with the acceleration a of the window's middle. The
ways between windows are a dt^2 / 2 of the step before each: so the stop stands where twice the last
of them, less the one before, and all over six tells it. Oil is soft enough to do without, and the
delay of a would damp it.
"""

from __future__ import annotations

from testbed.compiled import njit_law
from testbed.laws.axis_records import AxisInput


@njit_law(forceinline=True)
def centre_window(rod: AxisInput, extension: float, rate: float, dt: float) -> None:
    """Let an AxisInput run through `extension` (m) at `rate` (m/s), from dt / 2 before to dt / 2
    after.
    """
    rod.extension, rod.rate = extension - 0.5 * dt * rate, rate
