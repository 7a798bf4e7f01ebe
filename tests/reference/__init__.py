"""A second, independent simulator of machine axes with friction: judge of plant/, source of blind recordings.

Shares no code with plant/. Where plant/ marches an implicit midpoint step with projected (set-valued) friction, this
one is a hybrid automaton: explicit fourth-order Runge-Kutta inside each mode (slides up, slides down, rests), the
instant of every change of mode located inside the step. Smooth cases are judged a third time by `ivp` (solve_ivp).

Read in this order: parameters (the machine), physics (its equations), integrator (the automaton), control (loops that
run inside), machine (the front door `run`), excitation (torques and motions), recording (sensors and drive artefacts),
foreign (physics outside the catalogue), draws and cases (machines and blind recordings at random).
"""
