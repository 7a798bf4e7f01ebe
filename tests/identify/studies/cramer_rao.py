"""How well can these recordings be known at all? The Cramer-Rao bound beside what we reach. `make cramer-rao`.

The bound of the linearised problem along the true motion: a Kalman filter that knows the true parameters, how the
friction changes with speed, and the size and correlation of the force nobody modelled, whitens the data; what each
parameter changes in its innovations is the Fisher information. Where the machine rests nothing changes. Nobody who does
not know better than the truth can err less on average (but for the kinks at break-away, which no derivative sees).
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
from numba import njit

from identify.identification import identify_friction
from plant.kernels.step import advance_velocity
from tests.identify.studies.blind_starts import EXCITATIONS
from tests.identify.studies.machines import FRICTION, RATED, Case, Setting, draw_case

SUBSTEPS = 20  # per sample
DELTA = 1e-5  # relative step of differences; of the speed in m/s
PUSH = 1e-3  # N
MEDIAN = 0.6745  # of a standard deviation: median of |error|
ANYWHERE = 1.0  # m and m/s: standard deviation of the unknown first state
OFFSET = 0.01 * RATED  # N, what the fit is told about the constant force too


@njit(cache=True)
def one_step(v: np.ndarray, force: np.ndarray, laws: np.ndarray, mass: float, h: float, out: np.ndarray) -> None:
    """Way [m] and velocity [m/s] after one sample of length h [s] at `laws` F_c, F_s, log v_s, F_v, F_0 (5, q)."""
    step = h / SUBSTEPS
    for j in range(v.shape[0]):
        speed, way = v[j], 0.0
        coulomb, static, inverse, viscous = laws[0, j], laws[1, j], np.exp(-laws[2, j]), laws[3, j]
        for _ in range(SUBSTEPS):
            drive = force[j] - laws[4, j]
            ahead, mean = advance_velocity(speed, drive, 0.0, mass / step, coulomb, static - coulomb, inverse, viscous)
            way += step * mean
            speed = ahead
        out[0, j], out[1, j] = way, speed


def information(
    velocity: np.ndarray,
    force: np.ndarray,
    law: np.ndarray,
    mass: float,
    h: float,
    noise: float,
    dirt: float,
    phi: float,
) -> np.ndarray:
    """Fisher information of F_c, F_s, log v_s, F_v, F_0 in positions along a motion. (5, 5)

    Args:
        velocity: true. [m/s] (n,)
        force: drive force less weight. [N] (n,)
        law: true parameters. (5,)
        mass: moving. [kg]
        h: sample time. [s]
        noise: of the position. [m]
        dirt: rms of the force nobody modelled. [N]
        phi: its correlation from sample to sample. [1]
    """
    p = len(law)
    # columns: as it is, faster, pushed harder, each parameter moved
    change = np.concatenate([[1.0, DELTA, PUSH], DELTA * np.maximum(np.abs(law), 1.0)])
    laws = np.repeat(law[:, None], 3 + p, axis=1)
    laws[np.arange(p), 3 + np.arange(p)] += change[3:]
    spread, sense = np.diag([ANYWHERE**2, ANYWHERE**2, dirt**2]), np.zeros((3, p))
    found, move, out = np.zeros((p, p)), np.diag([1.0, 0.0, phi]), np.empty((2, 3 + p))
    fresh = dirt**2 * (1.0 - phi**2)
    for k in range(len(velocity) - 1):
        seen = spread[0, 0] + noise**2
        found += np.outer(sense[0], sense[0]) / seen
        gain = spread[:, 0] / seen
        sense = sense - np.outer(gain, sense[0])
        spread = spread - np.outer(gain, spread[0])
        v, f = np.full(3 + p, velocity[k]), np.full(3 + p, force[k])
        v[1] += DELTA
        f[2] += PUSH
        one_step(v, f, laws, mass, h, out)
        slope = (out - out[:, :1]) / change
        move[:2, 1:] = slope[:, 1:3]
        sense = move @ sense
        sense[:2] += slope[:, 3:]
        spread = move @ spread @ move.T
        spread[2, 2] += fresh
    return found


def bound(case: Case, setting: Setting) -> np.ndarray:
    """Least standard deviations of F_c, F_s, log v_s, F_v, relative ones. (4,)"""
    true = np.array([case.truth[name] for name in (*FRICTION, "constant_force")])
    law = true.copy()
    law[2] = np.log(law[2])
    recording, mechanics = case.recording, case.axis.mechanics
    dirt = setting.dirt * case.truth["coulomb_force"] + 1e-9
    known = information(
        case.velocity, recording.force - mechanics.weight, law, mechanics.moving_mass, setting.period,
        setting.noise, dirt, float(np.exp(-setting.period / setting.dirt_time)),
    )  # fmt: skip
    known[4, 4] += OFFSET**-2.0
    deviation = np.sqrt(np.diag(np.linalg.inv(known)))[:4]
    return deviation / np.array([true[0], true[1], 1.0, true[3]])


def main() -> None:
    """Print the table; `--plants N --dirt SHARE`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plants", type=int, default=20)
    parser.add_argument("--dirt", type=float, default=0.005, help="share of F_c")
    parser.add_argument("--noise", type=float, nargs="*", default=[1e-4], help="m")
    options = parser.parse_args()
    print("| motion | noise m | ours, median error % Fc/Fs/vs/Fv | bound | rms error over the bound |")
    for excitation in EXCITATIONS:
        for noise in options.noise:
            setting = Setting(excitation, noise=noise, samples=3000, dirt=options.dirt)
            errors, bounds = [], []
            for seed in range(9000, 9000 + options.plants):
                case = draw_case(seed, replace(setting))
                result = identify_friction(case.recording, case.axis, seed=seed)
                errors.append([np.log(result.parameters[name].value / case.truth[name]) for name in FRICTION])
                bounds.append(bound(case, setting))
            ours = 100 * np.median(np.abs(errors), axis=0)
            least = 100 * MEDIAN * np.median(bounds, axis=0)
            ratio = np.sqrt(np.mean((np.array(errors) / np.array(bounds)) ** 2, axis=0))
            cells = (" / ".join(f"{x:.2f}" for x in row) for row in (ours, least, ratio))
            print(f"| {excitation} | {noise:g} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
