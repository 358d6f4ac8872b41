# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The prediction as the public Python API gives it: also as plain values, as a table and as a drawing."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from foc_ros.core import prediction as core_prediction


class Prediction(core_prediction.Prediction):
    """The prediction for one hand sample.

    Attributes
    ----------
    t, solve_s : float
        Time of the hand sample, and wall time of the prediction [s].
    candidates : tuple of PredictedCandidate
        Solved ones first, the most likely first; then those that could not be solved, with their status. The `height` of a
        candidate has `mean` and `covariance` of the height over the plane and its derivatives, None where it is not predicted.
    most_likely : str or None
        Label of the most likely class, which changes only when another one leads by 0.15; None if none was solved.
    unknown : float
        Share of the likelihood of classes that the search has seen and that are no candidates.
    other : float
        Share of the likelihood of a goal that nobody announced; with both, likelihoods sum to one.
    obstacles : Obstacles
        The obstacles at time `t`.
    goals : tuple of PredictedGoal
        Name, position and likelihood of each goal, in their order; the likelihood is None where nothing is known of it.
    goal_positions : ndarray of shape (g, 2)
        The positions of the goals alone [m].
    cleared : tuple of bool
        For each obstacle, whether the hand is predicted to pass above or below it, so that it does not block.
    notes : dict
        Counts of events such as merged classes and culled obstacles.

    `len`, iteration, indices and slices are those of the candidates.
    """

    def to_dict(self) -> dict[str, Any]:
        """Return the prediction as plain values, ready for `json.dumps`: null stands for what is not known.

        Returns
        -------
        dict
            `stamp_ns`, `most_likely`, `unknown`, `other`, `goals` with `name`, `position` and `likelihood`, and `candidates` with
            the keys of ``foc_ros solve --json``.
        """
        from foc_ros.io.json_output import encode_prediction

        return encode_prediction(self)

    def to_records(self) -> list[dict[str, Any]]:
        """Return a table of the candidates' paths, one row for each step: ``pandas.DataFrame(prediction.to_records())``.

        Returns
        -------
        list of dict
            Rows of `t_s` (of the hand sample), `label`, `way`, `goal`, `status`, `likelihood` (nan without one), `eta`, `ahead_s`
            (from then on), `x_m`, `y_m`, `vx_m_s`, `vy_m_s`, and of the total covariance `xx_m2`, `xy_m2`, `yy_m2`.
        """
        names = [each.name for each in self.goals]
        columns = ('ahead_s', 'x_m', 'y_m', 'vx_m_s', 'vy_m_s', 'xx_m2', 'xy_m2', 'yy_m2')
        rows: list[dict[str, Any]] = []
        for each in self.candidates:
            known = {
                't_s': self.t,
                'label': each.label,
                'way': each.way,
                'goal': names[each.candidate.goal],
                'status': each.status.value,
                'likelihood': each.likelihood if each.has_likelihood else math.nan,
                'eta': each.eta,
            }
            numbers = [each.times, *each.mean[:, :4].T, *(each.covariance[:, i, j] for i, j in ((0, 0), (0, 1), (1, 1)))]
            rows += [known | dict(zip(columns, row, strict=True)) for row in np.column_stack(numbers).tolist()]
        return rows

    def plot(self, axes: Any = None) -> Any:
        """Draw the candidates in their scene, the thicker the more likely; those without a likelihood are grey.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Axes to draw on; new ones by default.

        Returns
        -------
        matplotlib.axes.Axes
            The axes that hold the drawing.
        """
        from foc_ros.reporting.figures import plot_prediction

        return plot_prediction(self, axes)
