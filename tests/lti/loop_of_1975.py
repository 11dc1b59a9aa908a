"""The two loops of the 1975 report with a current lag of 10 ms, from its coefficients: systems for tests to measure.

Mass matrix × d²q/dt² = K q + B α, α following its command within the lag; the command is a sum over displacements p of
K_p p + K_d s/(1 + τs) p + K_v τ/(1 + τs) d²p/dt² + K_a d²p/dt². The inputs are the currents of the front and the rear
pair, each pair as one pattern of length one. Coefficients: report, Appendix A and Tables B-1, B-2 evaluated with
a_F = 9.00, a_R = 7.65, c = 1.21 m; inertias as inferred from the printed roots.
"""

import numpy as np

TAU = 0.637
LAG = 0.010
MASS = 444800 / 9.80665


def heave_pitch():
    """Open loop (A, B, C), 10 states: K_h −2.155, K_hdot = K_zdot = 0.15."""
    K = np.array([[-3.5749e6, 2.4130e6], [2.3492e6, -2.4880e8]])
    B = 2 * np.array([[-3.3981e5, -3.3981e5], [3.0504e6, -2.6075e6]])
    heads = np.array([[1, -9.0], [1, 7.65]])
    return _loop(np.diag([MASS, 3.41e6]), K, B, np.eye(2), heads, [-2.155] * 2, [0.15] * 2, [0.0] * 2)


def sway_roll_yaw():
    """Open loop (A, B, C), 14 states: lateral rates 0.294, acceleration −0.02, the vertical channel through roll."""
    c, K_sway, K_roll, K_yaw = 1.21, 0.518, 1.25, 3.5
    K = np.array([[-1.2972e6, 1.4402e6, -8.756e5], [1.4402e6, -4.7241e6, 9.603e5], [-8.908e5, 7.432e5, -9.0651e7]])
    B = 2 * np.array([[6.3715e4] * 2, [-4.3248e5] * 2, [5.7977e5, -4.8109e5]])
    displacements = np.array([[1, -c, 0], [0, 1, 0], [0, 0, 1.0]])
    heads = np.array([[-K_sway, c * (K_roll - K_sway), -9.0 * K_yaw], [-K_sway, c * (K_roll - K_sway), 7.65 * K_yaw]])
    gains = [0, -2.155, 0], [0.294, 0.15, 0.294], [-0.02, 0, -0.02]
    return _loop(np.diag([MASS, 7.53e4, 3.35e6]), K, B, displacements, heads, *gains)


def _loop(mass, K, B, displacements, heads, K_p, K_d, K_a):
    n, m, k = len(mass), B.shape[1], len(displacements)
    position, rate, current, slow, felt = np.split(np.arange(2 * n + m + 2 * k), np.cumsum([n, n, m, k]))
    A_loop = np.zeros((2 * n + m + 2 * k,) * 2)

    def put(rows, columns, block):
        A_loop[np.ix_(rows, columns)] = block

    stiffness, force = np.linalg.solve(mass, K), np.linalg.solve(mass, B)
    put(position, rate, np.eye(n))
    put(rate, position, stiffness)
    put(rate, current, force)
    put(current, current, -np.eye(m) / LAG)
    put(slow, position, displacements / TAU)
    put(slow, slow, -np.eye(k) / TAU)
    put(felt, position, displacements @ stiffness / TAU)
    put(felt, current, displacements @ force / TAU)
    put(felt, felt, -np.eye(k) / TAU)
    B_loop = np.zeros((len(A_loop), m))
    B_loop[current] = np.eye(m) / LAG
    C_loop = np.zeros((m, len(A_loop)))
    K_p, K_d, K_a = (np.diag(gain) for gain in (K_p, K_d, K_a))
    C_loop[:, position] = heads @ ((K_p + K_d / TAU) @ displacements + K_a @ displacements @ stiffness)
    C_loop[:, current] = heads @ K_a @ displacements @ force
    C_loop[:, slow] = -heads @ K_d / TAU
    C_loop[:, felt] = heads @ K_d * TAU  # absolute and relative rates have the same gain
    return A_loop, B_loop, -C_loop
