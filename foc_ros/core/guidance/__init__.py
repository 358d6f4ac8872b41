"""From a prediction to assistance: one hand pose and the newest prediction in, a bounded and passive guiding force out.

May import the types, the config and the obstacles. Pure functions of their arguments and an explicit state; `guide.guide` calls
the others in their order.
"""
