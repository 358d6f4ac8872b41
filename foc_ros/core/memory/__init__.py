"""Memory: what one prediction passes to the next, so that answers continue and classes keep their numbers.

Enters: the memory of the last prediction and what is found now. Leaves: answers that continue, and the memory for the next one.
It may import all of `foc_ros.core` but the predictor and the pipeline.
"""
