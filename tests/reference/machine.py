"""The front door: a machine, an excitation, what it did: true values at every stamp of the drive, before any sensor.

Example:
    plant = ReferencePlant(effects={"rail_defect": {"amplitude": 40.0, "centre": 0.1, "width": 0.01}})
    t = stamps(20.0, 0.01)
    what = run(plant, Torque(t, plant.weight / plant.gain + sine(t, 2.1, 0.2)))
    what["position"]  # [m], what["velocity"], what["force_command"] [N] as the recording's force column has it
"""

import numpy as np

from .control import NO_LOOP
from .excitation import Motion, Torque, stamps
from .integrator import march
from .parameters import ReferencePlant

__all__ = ["Motion", "ReferencePlant", "Torque", "default_step", "run", "stamps"]


def default_step(plant: ReferencePlant) -> float:
    """Largest step of the automaton [s]: 50 µs where something stiff is inside, else 100 µs; errors below 0.01 µm."""
    stiff = {"presliding_hysteresis", "backlash", "transmission_compliance"}
    return 5e-5 if stiff & set(plant.effects) else 1e-4


def run(
    plant: ReferencePlant,
    excitation: Torque | Motion,
    *,
    outer_force=None,
    extra_level=None,
    level_factor=None,
    loop_noise=None,
    position0: float = 0.0,
    velocity0: float = 0.0,
    settled: bool | str = False,
    step: float | None = None,
) -> dict[str, np.ndarray]:
    """March the machine over the excitation's stamps.

    Args:
        plant: the machine.
        excitation: open loop (`Torque`) or closed loop (`Motion` with its `Loop`).
        outer_force: additional force on the load, positive upwards, linear between stamps. [N] (n,)
        extra_level: added to the dry friction level, both directions. [N] (n,)
        level_factor: the dry level is multiplied by 1 + this. [1] (n,)
        loop_noise: noise of the position the loop sees. [m] (n,)
        position0, velocity0: initial state of the load. [m], [m/s]
        settled: belt ("belt") or belt and bristles (True) start stretched so that they carry the load; else relaxed.
        step: largest step. [s] Default `default_step`.

    Returns:
        t; force_command (torque x gain as a recording would hold it, before delay, limit, lag ...), position, velocity,
        motor_position, force (what the transmission carries into the load), mode (+1, 0, -1; bristle deflection with
        presliding), drive_work, lost_work [J], extra_stiction [N]; arrays (n,).
    """
    t = np.ascontiguousarray(excitation.t, dtype=float)
    n = len(t)
    outer = np.zeros((3, n))
    for row, series in enumerate((outer_force, extra_level, level_factor)):
        if series is not None:
            outer[row] = series
    noise = np.zeros(n) if loop_noise is None else np.asarray(loop_noise, dtype=float)
    if isinstance(excitation, Torque):
        command = np.array(excitation.torque, dtype=float) * plant.gain
        loop, reference, linear = NO_LOOP, np.zeros((3, 1)), excitation.hold == "linear"
    else:
        command = np.zeros(n)
        loop, linear = excitation.loop.as_array(), False
        reference = np.array([excitation.position, excitation.velocity, excitation.acceleration], dtype=float)
    trace = np.zeros((8, n))
    record = plant.record()
    start = np.array([position0, velocity0])
    limit = default_step(plant) if step is None else step
    tension = 1 if settled == "belt" else 2 * bool(settled)
    march(record, t, command, linear, outer, loop, reference, noise, start, tension, limit, trace)
    names = ("position", "velocity", "motor_position", "force", "mode", "drive_work", "lost_work", "extra_stiction")
    return {"t": t, "force_command": command, **dict(zip(names, trace, strict=True))}
