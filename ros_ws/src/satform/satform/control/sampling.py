"""What holding a command over a step does to a control loop."""

import numpy as np

from satform.elementwise import Array


def require_stable_hold(closed_loop: Array, name: str, step: float) -> None:
    """Refuse gains whose closed loop, sampled once a step, does not decay.

    Args:
        closed_loop: state transition over one step with the command held, shape (m, m).
        name: of the control law, for the message.
        step: control period, s.

    Raises:
        ValueError: an eigenvalue lies on or outside the unit circle.
    """
    radius = float(np.max(np.abs(np.linalg.eigvals(closed_loop))))
    if not radius < 1.0:
        raise ValueError(
            f"{name}: with the command held for {step:g} s the closed loop does not decay "
            f"(spectral radius {radius:.6g}, has to be below 1); shorten the step or lower the gains"
        )
