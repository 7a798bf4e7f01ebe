"""How an effect's law is compiled and called: one address per law, so any subset of effects runs without recompiling.

A machine lives in a *block*: one flat array of rows, each row `LANES` numbers long, one number per candidate. Row names
below are offsets, so `b[DRIVE + j]` is the drive force of candidate j. A law gets the time, the sub-step, and pointers
to its own parameters `p`, its own states `x` and the block `b`; it reads rows of the block and adds to others:

* phase `TO_DRIVE`, once per sub-step, may change `DRIVE`, the force on its way from the drive to the motor pulley;
* phase `TO_STEP`, once per sub-step, sees the final `DRIVE` and `TRANSMITTED` and may change the friction;
* phase `TO_STAGE`, before each of the two velocity solutions, sees `VELOCITY` and adds to `STAGE_*`;
* phase `AFTER`, when the sub-step is done, advances the law's states.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from llvmlite import ir
from numba import cfunc, types
from numba.extending import intrinsic

from plant.kernels.step import FASTMATH

LANES = 16  # candidates side by side: two 512-bit or four 256-bit vectors, enough to hide the latency of the chain

TO_DRIVE, TO_STEP, TO_STAGE, AFTER = 0, 1, 2, 3

(
    # states of the machine
    POSITION,  # y of the load, at the start of the sub-step [m]
    SPEED,  # v of the load, at the start of the sub-step, signed [m/s]
    MOTOR_POSITION,  # two masses only [m]
    MOTOR_SPEED,  # two masses only [m/s]
    BRISTLE,  # z of LuGre [m]
    # what the caller sets for each sample
    START,  # drive force just after the sample [N]
    END,  # drive force just before the next sample [N]
    SWITCH,  # fraction of the sample after which START_2 and END_2 hold instead; 1: never [1]
    START_2,  # like START, of the line after the switch, drawn back to the sample [N]
    END_2,  # like END, of the line after the switch [N]
    EXTRA,  # further force on the load, e.g. an observer's latent force [N]
    # constants of the machine
    COULOMB,  # F_c [N]
    BUMP,  # F_s - F_c [N]
    INVERSE_STRIBECK,  # 1/v_s [s/m]
    EXPONENT,  # of |v|/v_s in eq. (1): 1 of the paper [1]
    VISCOUS,  # F_v [N s/m]
    MASS,  # m_e; the load's share where there are two masses [kg]
    AGAINST,  # M g + constant force [N]
    MOTOR_MASS,  # two masses only [kg]
    STIFFNESS,  # of the transmission [N/m]
    DAMPING,  # of the transmission [N s/m]
    HALF_GAP,  # half the free travel [m]
    MOTOR_SHARE,  # of the friction, that rubs at the motor; not of bristles [1]
    BENT,  # of the drive force: what bends the transmission where a predicted run begins [1]
    HANGS,  # of M g + constant force: the same [1]
    HARDENING,  # how the transmission's stiffness grows: k (1 + c x^2), x its stretch [1/m^2]
    BRISTLE_STIFFNESS,  # sigma_0 [N/m]
    BRISTLE_DAMPING,  # sigma_1 [N s/m]
    BRISTLE_POWER,  # i - 1 of z' = v (1 - sgn(v) sigma_0 z/g)^i: 0 of LuGre [1]
    # at mid-step, for the laws to read
    MIDDLE,  # position of the load [m]
    MOTOR_MIDDLE,  # position of the motor, at the belt [m]
    VELOCITY,  # best estimate of the load's velocity [m/s]
    TRANSMITTED,  # force the transmission carries [N]
    # at mid-step, for the laws to change
    DRIVE,  # drive force [N]
    RAMP,  # by how much it grows over the sub-step [N]
    FORCE,  # added force on the friction side of the load [N]
    MOTOR_FORCE,  # added force on the friction side of the motor [N]
    FORWARD,  # factor on the dry level of eq. (1) moving up [1]
    BACKWARD,  # factor on it moving down [1]
    CLIMB,  # added to F_c [N]
    RISE,  # added to F_s [N]
    LEVEL,  # added to the dry level [N]
    VISCOUS_FORWARD,  # viscous coefficient moving up [N s/m]
    VISCOUS_BACKWARD,  # viscous coefficient moving down [N s/m]
    DRAG,  # quadratic coefficient [N s^2/m^2]
    STAGE_LEVEL,  # added to the dry level, set in phase TO_STAGE [N]
    STAGE_FORCE,  # added force on the friction side, set in phase TO_STAGE [N]
    # results
    AHEAD,  # velocity of the load at the end of the sub-step [m/s]
    MOTOR_AHEAD,  # velocity of the motor there [m/s]
    FRICTION,  # dry and viscous friction over the sub-step [N]
    # scratch of the kernel
    UP,
    DOWN,
    RESIST,
    HELD,
    BEFORE,
    FOLLOWS,
    DECAYS,
    PACE,
    SOFTER,
) = range(0, 59 * LANES, LANES)
ROWS = SOFTER // LANES + 1  # rows before the states and parameters of the effects

_DOUBLES: Any = types.CPointer(types.float64)  # type: ignore[no-untyped-call]
SIGNATURE = types.void(types.float64, types.float64, _DOUBLES, _DOUBLES, _DOUBLES)


class Rows(Protocol):
    """A bare pointer to rows: `p[j]` is the first row's value of candidate j, `p[LANES + j]` the second's."""

    def __getitem__(self, index: int) -> float: ...

    def __setitem__(self, index: int, value: float) -> None: ...


class Law:
    """A compiled law of one effect: compiled, or loaded from the cache, when its address is first asked for."""

    def __init__(self, phase: int, function: Callable[..., None]) -> None:
        """Keep the phase and the Python function."""
        self.phase = phase
        self.__doc__ = function.__doc__
        self._function = function
        self._compiled: Any = None

    @property
    def address(self) -> int:
        """Where the machine code starts in this process."""
        if self._compiled is None:
            compile_law = cfunc(SIGNATURE, cache=_has_file(self._function), fastmath=FASTMATH, error_model="numpy")
            self._compiled = compile_law(self._function)
        return int(self._compiled.address)


def _has_file(function: Callable[..., None]) -> bool:
    return Path(function.__code__.co_filename).is_file()


def law(phase: int) -> Callable[[Callable[..., None]], Law]:
    """Turn `function(t, h, p, x, b)` into a law of `phase`; its body may use numbers and other compiled code."""
    return lambda function: Law(phase, function)


_intrinsic: Any = intrinsic  # its decorated functions are called without the first argument, which no type says


@_intrinsic
def call(typingctx: Any, address: Any, t: Any, h: Any, p: Any, x: Any, b: Any) -> Any:  # noqa: ARG001
    """Call the law at `address` with the time, the sub-step, and the addresses of its rows."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:  # noqa: ARG001
        double, pointer = ir.DoubleType(), ir.DoubleType().as_pointer()
        function = ir.FunctionType(ir.VoidType(), [double, double, pointer, pointer, pointer]).as_pointer()
        rows = [builder.inttoptr(arg, pointer) for arg in args[3:]]
        builder.call(builder.inttoptr(args[0], function), [args[1], args[2], *rows])
        return context.get_constant(types.int64, 0)

    word, real = types.int64, types.float64
    return types.int64(word, real, real, word, word, word), codegen


@_intrinsic
def rows(typingctx: Any, block: Any) -> Any:  # noqa: ARG001
    """The block as a bare pointer, like a law sees it: no wrap-around of negative indices, so LLVM vectorises."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return context.make_array(signature.args[0])(context, builder, args[0]).data

    return _DOUBLES(block), codegen


@_intrinsic
def address(typingctx: Any, pointer: Any) -> Any:  # noqa: ARG001
    """Where a bare pointer points."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:  # noqa: ARG001
        return builder.ptrtoint(args[0], ir.IntType(64))

    return types.int64(_DOUBLES), codegen
