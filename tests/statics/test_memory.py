"""The kernel writes within its arrays: problems with many tendon ends and odd step counts, with bounds checked.

The check is compiled in by Numba, which takes a while, so it runs in a process of its own.
"""

import os
import subprocess
import sys

import pytest

PROBLEMS = """
import numpy as np
from tendonrod import PlainRod, Robot, Tendon, solve

body = PlainRod(length=0.2, radius=0.5e-3, youngs_modulus=75e9, shear_modulus=25e9, density=6255.0)
def robot(*ends):
    return Robot(name="rod", body=body, tendons=[Tendon.constant(x=1e-3, y=0.0, end=end) for end in ends])
gravity = (0.0, -9.81, 0.0)
for steps in (1, 2, 3, 24, 25, 27, 29, 64):
    for ends in ((0.1,), (0.07, 0.13), (0.05, 0.1, 0.15), (0.1, 0.1), ()):
        shape = solve(robot(*ends), 0.5 if ends else 0.0, gravity, steps=steps)
        assert shape.converged and shape.s[-1] == 0.2
        shape.at(np.linspace(0.0, 0.2, 7)), shape.stable, shape.warnings
many = robot(*np.linspace(0.01, 0.2, 120))
shape = solve(many, 1e-3, gravity)
solve(many, 1.02e-3, gravity, start=shape)
solve(many, 1e-3, gravity, accuracy=1e-9, start=shape)
solve(robot(0.1), 0.5, tip_force=(0.0, 0.3, -0.5), throw=False)
print("within bounds")
"""


@pytest.mark.slow
def test_kernel_stays_within_its_arrays(tmp_path):
    checked = {**os.environ, "NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", PROBLEMS], env=checked, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout == "within bounds\n"
