"""The scenes of the studies, found by `scripts/find_paper_scenes.py`, because the paper gives no coordinates."""

from __future__ import annotations

from foc_ros.core.types import LEFT, RIGHT

from .reaching import PaperScene, PathClass

NOISE, SMALL_NOISE = 0.15, 0.05
"""c of the paper's studies: of all but the fourth, and of the fourth; per step, as the paper draws it."""

STRATEGY_SCENE = PaperScene(
    0.3,
    ((0.0883, 0.0249, 0.0263, 0.0013), (0.1051, -0.0153, 0.0184, 0.003), (0.0707, -0.0181, 0.0279, 0.0019)),
    (PathClass('left', 0.06, ()),),
)
"""Of studies 1 to 4 and 7: J_LV / J_HC rises through 1 for NOISE and never exceeds it for SMALL_NOISE (search `strategies`)."""

CLASSES_SCENE = PaperScene(
    0.3,
    ((0.0976, -0.0041, 0.0191, 0.0036), (0.1692, -0.1516, 0.035, 0.0028)),
    (PathClass('H1', 0.06, (('0', LEFT),)), PathClass('H2', -0.05, (('0', RIGHT), ('1', LEFT)))),
)
"""Of studies 5 and 6: J_H1 / J_H2 is near 1 up to eta 0.9, and at 0.9615 near the paper's for LV and HC (search `classes`)."""
