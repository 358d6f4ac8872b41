"""The names of the simulated operators and of the assistance rules, apart from both because their import takes seconds."""

ACCURATE, NOISY, LAGGY = 'accurate', 'noisy', 'laggy'
CHANGES_WAY, UNANNOUNCED_GOAL, HUMAN_PATHS = 'changes_way', 'unannounced_goal', 'human_paths'
OPERATORS = (ACCURATE, NOISY, LAGGY, CHANGES_WAY, UNANNOUNCED_GOAL, HUMAN_PATHS)
NONE, FOC = 'none', 'foc'
ASSISTANCE = (NONE, FOC)
