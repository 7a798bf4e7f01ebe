"""THE PARAMETERS: from one recording to an answer with its uncertainty."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from identify.identification import identify_friction
    from identify.many import identify_many
    from identify.mismatch.diagnosis import diagnose
    from identify.mismatch.result import Diagnosis
    from identify.result import IdentificationResult, Parameter, Verdict

__all__ = [
    "Diagnosis",
    "IdentificationResult",
    "Parameter",
    "Verdict",
    "diagnose",
    "identify_friction",
    "identify_many",
]

_HOMES = {
    "diagnose": "identify.mismatch.diagnosis",
    "Diagnosis": "identify.mismatch.result",
    "identify_friction": "identify.identification",
    "identify_many": "identify.many",
    "IdentificationResult": "identify.result",
    "Parameter": "identify.result",
    "Verdict": "identify.result",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for: compiled kernels are not free."""
    if name not in _HOMES:
        raise AttributeError(f"module 'identify' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOMES[name]), name)
