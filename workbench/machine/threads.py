"""One thread for linear algebra, so that the same call gives the same bits in every process and on any machine.

    workbench command, worker process --keep_one_thread--> variables that libraries read when they are loaded
    a call inside somebody's process  --one_thread-------> these, and a limit on the libraries that are loaded already

Matrices here are of order 10 to 100: a second thread only waits, and sums in another order. A library loaded later
than a limit on the loaded ones (SciPy brings a BLAS of its own) would run on all cores: hence the variables.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager

# read by OpenBLAS, MKL, BLIS, Accelerate and OpenMP at their start
VARIABLES = (
    "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "OMP_NUM_THREADS",
)  # fmt: skip


def keep_one_thread() -> None:
    """For the rest of this process, and of those it starts; the first thing that a process of ours does."""
    import sys

    os.environ.update(dict.fromkeys(VARIABLES, "1"))
    if "numpy" in sys.modules:  # whoever started this process had loaded it
        from threadpoolctl import threadpool_limits

        threadpool_limits(1)


@contextmanager
def one_thread() -> Iterator[None]:
    """While it lasts: of the libraries that are loaded, of those loaded meanwhile, of processes started meanwhile."""
    from threadpoolctl import threadpool_limits

    before = {name: os.environ.get(name) for name in VARIABLES}
    os.environ.update(dict.fromkeys(VARIABLES, "1"))
    try:
        with threadpool_limits(1):
            yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
