"""Learning: movements that ended enter; what they say about the operator and about the scene leaves.

`pace` is how the operator moves and arrives, `choices` how precisely they choose, `dispersion` how large the errors of
predictions are, `experience` which ways and paths recordings of the same scene take. It may import all of `foc_ros.core` but
`candidates`, `memory`, the predictor and the pipeline.
"""
