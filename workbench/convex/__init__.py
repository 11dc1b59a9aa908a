"""The convex engine: what can be decided about linear systems by semidefinite programmes and duality.

state matrices   --lyapunov---->  a quadratic form that decays along all of them
design problem   --bound------->  what no linear controller can undercut
"""
