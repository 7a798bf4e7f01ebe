"""A third simulator of machine axes: second judge of the diagnosis, by an author who never saw this project's code.

Shares no line with plant/, identify/, monitor/ or tests/reference: an import contract of pyproject.toml keeps it so.
One or two masses in steps of 25-50 us (implicit in friction alone), set-valued, bristle or Maxwell-slip friction,
driven by a digital cascade with feed-forward and a clamped integrator. Its curves are its author's own: Hunt-Crossley
end stops, skewed bumps on the rail, ripple with a second harmonic, a soft saturation, Stribeck exponents of 0.8-1.3.
All lengths, forces and masses of a rotary axis are angles, torques and inertias. [rad, N*m, kg*m^2]

Read in this order: parameters (the record the compiled code reads), laws (friction and forces), drive (cascade, current
loop, delays), machine (the march), motion (what is commanded), plants (machines at random), effects and outside (what
is hidden), measures (how much of it can be seen), sensors (what is written down), labels (the truth), cases (all of it
from one generator of random numbers).
"""
