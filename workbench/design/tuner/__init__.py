"""Fixed-structure tuning: models, controller structures with tunable parameters, loops, goals, the tuner.

    Model ──┐                        ┌──► goals ──► tune
            ├──► Loop ──► channels ──┘
Structure ──┘
"""
