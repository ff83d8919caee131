"""The compiled kernel against a hand-written C loop of the same algorithm, as ratios measured within one run.

    python benchmarks/c_loop.py

What is compared: one cold solve, from the problem in arrays to the solution in arrays, by `kernel.equilibrium` (Numba)
and by `equilibrium` in c_loop/rod.c, C as one writes it by hand: structs, static inline functions, no allocation. Both
lay the same grids, start from the same unloaded robot, make the same Newton and Broyden steps, check stability where
the kernel does, and refine until the error is within 1 um. The criterion is the C of plain ``gcc -O3``: at most 1.5
times its time. Numba compiles for the CPU it runs on and allows contraction, reciprocals and unsigned zeros, so two
more builds say what C does with that: ``-march=native``, where gcc contracts to fused multiply-add by default, and
besides it the flags nearest to Numba's {contract, nsz, arcp} (-ffp-contract=fast, -fno-signed-zeros,
-freciprocal-math) and to what LLVM assumes anyway (-fno-math-errno, -fno-trapping-math).

How: C is timed inside C, a loop over one problem between two clock_gettime. The kernel is timed the same way, in a loop
that Numba compiles, here; entering that loop once costs what an empty loop costs, which is printed. So neither time
holds a crossing from Python, which is measured apart, with the arrays that `Solution.run` makes. Rounds of all
candidates are interleaved and shorter than a time slice, and the least of all rounds counts: what others do on the
machine can only add to a time, and a median takes it for the program's own when the machine is busy.

Also here: the answers of both over random problems; that the cost grows linearly with tendons and steps; and that the
kernel allocates nothing, by the counters of Numba's runtime (tracemalloc does not see compiled code).
"""

from __future__ import annotations

import ctypes
import math
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numba
import numpy as np
from llvmlite import binding
from numba.core.runtime.nrt import rtsys

import tendonrod
from tendonrod import PlainRod, Robot, Tendon
from tendonrod.statics import kernel
from tendonrod.statics.equilibrium import prepare
from tendonrod.statics.solution import Solution, compiled

CRITERION = 1.5
CAPACITY = 512  # room, in steps, that both sides get
ROUNDS, ROUND_SECONDS = 151, 4e-4
BUILDS = {
    "-O3": ["-O3"],
    "-O3 native": ["-O3", "-march=native"],
    "-O3 native, Numba's flags": [
        "-O3", "-march=native", "-ffp-contract=fast", "-fno-signed-zeros", "-freciprocal-math", "-fno-math-errno",
        "-fno-trapping-math",
    ],
}  # fmt: skip
NAMES = {0: "converged", 1: "local failed", 2: "stalled", 3: "too small"}


class Result(ctypes.Structure):
    """``result`` of rod.c."""

    _fields_ = [(name, ctypes.c_int) for name in ("code", "iterations", "sweeps", "steps", "half")] + [
        (name, ctypes.c_double) for name in ("residual", "estimate", "moment_scale", "x", "y", "z")
    ]


class InC:
    """rod.c in one build."""

    def __init__(self, flags: list[str], folder: Path) -> None:
        library = folder / f"rod{len(list(folder.iterdir()))}.so"
        source = Path(__file__).parent / "c_loop" / "rod.c"
        subprocess.run(["gcc", *flags, "-shared", "-fPIC", str(source), "-o", str(library), "-lm"], check=True)
        self._library = ctypes.CDLL(str(library))
        self._library.workspace_size.restype = ctypes.c_size_t
        self._library.seconds.restype = ctypes.c_double
        self._room = ctypes.create_string_buffer(self._library.workspace_size())
        self._result = Result()

    def seconds(self, problem: Solution, repeats: int) -> float:
        """Time (s) of one solve, by the clock inside C."""
        return self._library.seconds(*self._arguments(problem), repeats)

    def answer(self, problem: Solution) -> tuple[tuple[int, ...], np.ndarray]:
        """(code, iterations, sweeps, steps), tip (m)."""
        self._library.solve(*self._arguments(problem))
        out = self._result
        return (out.code, out.iterations, out.sweeps, out.steps), np.array([out.x, out.y, out.z])

    def _arguments(self, problem: Solution):
        arrays = problem.rod, problem.tendons, problem.problem
        if [a.shape[-1] for a in arrays] != [13, 7, 30]:
            sys.exit(
                "rod.c does what the kernel did when its problems were rows of 13, 7 and 30: it must be brought up."
            )
        rod, tendons, ask = (ctypes.c_void_p(a.ctypes.data) for a in arrays)
        return rod, tendons, len(problem.tendons), ask, CAPACITY, self._room, ctypes.byref(self._result)


@numba.njit
def kernel_loop(repeats, rod, tendons, problem, state, jacobian, stats, scratch):
    code = -1
    for _ in range(repeats):
        code = kernel.equilibrium(rod, tendons, problem, state, jacobian, stats, scratch)
    return code


class InNumba:
    """The kernel in a compiled loop; same interface as `InC`."""

    def __init__(self) -> None:
        self._state, self._jacobian = np.empty(2 * (40 * CAPACITY + 19)), np.empty((3, 3))
        self._stats, self._scratch = np.empty(8), np.empty(kernel.SCRATCH)

    def seconds(self, problem: Solution, repeats: int) -> float:
        """Time (s) of one solve, entering the loop included; with no repeats, of entering it."""
        start = time.perf_counter()
        self._loop(problem, repeats)
        return (time.perf_counter() - start) / max(1, repeats)

    def answer(self, problem: Solution) -> tuple[tuple[int, ...], np.ndarray]:
        """(code, iterations, sweeps, steps), tip (m)."""
        self._stats[:] = 0.0
        code = self._loop(problem, 1)
        _, iterations, sweeps, _, steps, half = (int(value) for value in self._stats[:6])
        tip = half * (self._state.size // 2) + CAPACITY + 1 + 12 * steps
        return (code, iterations, sweeps, steps), self._state[tip : tip + 3].copy()

    def allocations(self, problem: Solution, repeats: int) -> tuple[int, ...]:
        """What the counters of Numba's runtime add up to over one call of the loop: alloc, free, mi_alloc, mi_free."""
        before = rtsys.get_allocation_stats()
        self._loop(problem, repeats)
        return tuple(b - a for a, b in zip(before, rtsys.get_allocation_stats(), strict=True))

    def _loop(self, problem: Solution, repeats: int) -> int:
        arrays = problem.rod, problem.tendons, problem.problem, self._state, self._jacobian, self._stats, self._scratch
        return kernel_loop(repeats, *arrays)


def interleaved(cases: dict) -> dict[str, float]:
    """Least time (s) of one solve for each case (candidate, problem), over rounds of about ROUND_SECONDS."""
    counts = {name: max(1, round(ROUND_SECONDS / who.seconds(what, 20))) for name, (who, what) in cases.items()}
    times = dict.fromkeys(cases, math.inf)
    for _ in range(ROUNDS):
        for name, (who, what) in cases.items():
            times[name] = min(times[name], who.seconds(what, counts[name]))
    return times


def plain_rod(*tendons: Tendon) -> Robot:
    body = PlainRod(length=0.2, radius=0.5e-3, youngs_modulus=75e9, shear_modulus=25e9, density=6255.0)
    return Robot(name="rod", body=body, tendons=tendons)


def four_tendons(turns: float) -> Robot:
    """Rucker & Webster's size of robot."""
    body = PlainRod(length=0.5, radius=1e-3, youngs_modulus=200e9, shear_modulus=80e9, density=8000.0)
    tendons = [Tendon.helical(offset=15.06e-3, angle=0.5 * np.pi * i, turns=turns) for i in range(4)]
    return Robot(name="four tendons", body=body, tendons=tuple(tendons))


PLAIN = plain_rod(Tendon.constant(x=1.5e-3, y=0.0))
MIXED = plain_rod(
    Tendon.helical(offset=2e-3, angle=0.3, turns=0.7),
    Tendon.constant(x=-1.5e-3, y=1e-3),
    Tendon.helical(offset=1.8e-3, angle=2.0, turns=-0.4, end=0.11),
)
PROTOTYPES = [tendonrod.load_robot(f"exonav-{number}") for number in (1, 2, 3, 4)]


def problem_of(robot: Robot, tensions, *loads, **more) -> Solution:
    problem = prepare(robot, tensions, *loads, **more)
    if not isinstance(problem, Solution):
        raise TypeError("a problem for another kernel")
    return problem


def measured_problems() -> dict[str, Solution]:
    gravity = (-9.81, 0.0, 0.0)
    return {
        "P1, 0.7 N, gravity": problem_of(PROTOTYPES[0], 0.7, gravity),
        "P3, 0.7 N, gravity": problem_of(PROTOTYPES[2], 0.7, gravity),
        "helical tendons, 2 N": problem_of(MIXED, 2.0, gravity),
        "four tendons": problem_of(four_tendons(0.0), [2.0, 1.0, 0.0, 0.5], gravity),
        "P1, 0.7 N, tip load": problem_of(PROTOTYPES[0], 0.7, tip_force=(0.0, 2e-3, 1e-3)),
    }


def random_problems(count: int) -> list[Solution]:
    """Of every kind: tendons straight, helical, ending half-way; every load; some past the first critical load."""
    rng, found = np.random.default_rng(8), []
    robots = [*PROTOTYPES, PLAIN, MIXED, four_tendons(0.0), four_tendons(1.0)]
    for i in range(count):
        robot = robots[i % len(robots)]
        soft = robot.section.Kbt[:2].min() / robot.section.L_na**2
        tensions = rng.uniform(0.0, 10.0 * soft * robot.section.L_na / robot.rod_constants[12] / 10.0, robot.n_tendons)
        size = soft * 10.0 ** rng.uniform(-2.0, 0.3)
        loads: dict = {"gravity": 9.81 * rng.normal(size=3) * rng.integers(2)}
        if i % 3:
            loads["tip_force"] = size * rng.normal(size=3)
        if i % 5 == 0:
            loads["tip_moment"] = 0.3 * size * robot.section.L_na * rng.normal(size=3)
        if i % 7 == 0:
            loads["distributed_force"] = size / robot.section.L_na * rng.normal(size=3)
            loads["distributed_moment"] = 0.3 * size * rng.normal(size=3)
        found.append(problem_of(robot, tensions, **loads, insertion=rng.uniform(0.4, 1.0), rotation=rng.uniform(-3, 3)))
    return found


def compare_answers(builds: dict[str, InC], in_numba: InNumba) -> None:
    problems = random_problems(200)
    theirs = [in_numba.answer(problem) for problem in problems]
    codes = [counts[0] for counts, _ in theirs]
    print(f"\nAnswers over {len(problems)} random problems (kernel: ", end="")
    print(", ".join(f"{codes.count(code)} {NAMES[code]}" for code in sorted(set(codes))) + "):")
    for name, in_c in builds.items():
        differ, far = 0, 0.0
        for problem, (counts, tip) in zip(problems, theirs, strict=True):
            own, own_tip = in_c.answer(problem)
            differ += own[:3] != counts[:3] or (counts[0] == 0 and own != counts)
            if counts[0] == own[0] == 0:
                far = max(far, float(np.linalg.norm(own_tip - tip)) / problem.length)
        verdict = "as wanted" if far <= 1e-12 else "MORE THAN 1e-12"
        print(f"  {name:26s} largest difference of tips {far:.1e} of the length ({verdict}); ", end="")
        print(f"code, iterations, sweeps or steps differ in {differ}")


def compare_times(builds: dict[str, InC], in_numba: InNumba) -> None:
    print(f"\n{'us per cold solve':24s}{'kernel':>9s}" + "".join(f"{name:>28s}" for name in builds))
    worst = 0.0
    for label, problem in measured_problems().items():
        cases: dict = {"kernel": (in_numba, problem)}
        cases |= {name: (in_c, problem) for name, in_c in builds.items()}
        times = interleaved(cases)
        worst = max(worst, times["kernel"] / times["-O3"])
        cells = [f"{1e6 * times[name]:14.2f}, ratio {times['kernel'] / times[name]:5.2f}" for name in builds]
        print(f"{label:24s}{1e6 * times['kernel']:9.2f}" + "".join(f"{cell:>28s}" for cell in cells))
    print(f"largest ratio to gcc -O3: {worst:.2f}, wanted <= {CRITERION}: {'met' if worst <= CRITERION else 'MISSED'}")


def show_crossing(in_numba: InNumba) -> None:
    """What the compiled loop leaves out: a call from Python and the arrays of `Solution.run`."""
    problem, scratch = measured_problems()["P1, 0.7 N, gravity"], np.empty(kernel.SCRATCH)
    problem.run()
    arrays = problem.rod, problem.tendons, problem.problem, problem.state, problem.jacobian, problem.stats, scratch
    calls = {
        "in the loop": lambda: in_numba.seconds(problem, 20),
        "empty loop": lambda: in_numba.seconds(problem, 0),
        "from Python": lambda: clocked(lambda: kernel.equilibrium(*arrays)),
        "Solution.run": lambda: clocked(problem.run),
    }
    t = dict.fromkeys(calls, math.inf)
    for _ in range(ROUNDS):
        for name, call in calls.items():
            t[name] = min(t[name], 1e6 * call())
    print(f"\nP1, us: kernel in the compiled loop {t['in the loop']:.2f} (entering it, once per round, ", end="")
    print(f"{t['empty loop']:.2f}), called from Python {t['from Python']:.2f}, Solution.run {t['Solution.run']:.2f}")


def clocked(call, calls: int = 20) -> float:
    start = time.perf_counter()
    for _ in range(calls):
        call()
    return (time.perf_counter() - start) / calls


def show_growth(in_numba: InNumba) -> None:
    """Cost against tendons: one tendon's tension shared by k in its place, so the work but for them stays the same."""
    loads: dict = {"tip_force": (0.05, 0.1, 0.0)}
    for name, tendon in (
        ("straight tendons", Tendon.constant(x=1.5e-3, y=0.0)),
        ("helical tendons", Tendon.helical(offset=1.5e-3, angle=0.0, turns=0.5)),
    ):
        shared = {k: problem_of(plain_rod(*[tendon] * k), 4.0 / k, **loads, steps=16) for k in (1, 2, 4, 8)}
        show_line(name, shared, in_numba)
    show_line("steps", {n: problem_of(PLAIN, 4.0, **loads, steps=n) for n in range(8, 129, 8)}, in_numba)


def show_line(what: str, problems: dict[int, Solution], in_numba: InNumba) -> None:
    """The line nearest to the measured times, each weighed by its size, and how far they are from it."""
    times = interleaved({str(k): (in_numba, problem) for k, problem in problems.items()})
    k, t = np.array(list(problems), dtype=float), 1e6 * np.array(list(times.values()))
    slope, offset = np.polyfit(k, t, 1, w=1.0 / t)
    off = np.abs(t - offset - slope * k) / t
    sweeps = [in_numba.answer(problem)[0][2] for problem in problems.values()]
    print(f"\n{what}: {offset:.2f} us + {slope:.3f} us each; off that line by at most {100 * off.max():.1f} %")
    print("  " + ", ".join(f"{n:.0f}: {us:.1f} us ({s} sweeps)" for n, us, s in zip(k, t, sweeps, strict=True)))


def show_allocations(in_numba: InNumba) -> None:
    from numba.core.runtime import _nrt_python  # pyright: ignore[reportAttributeAccessIssue]

    _nrt_python.memsys_enable_stats()  # as NUMBA_NRT_STATS=1 does at start
    print("\nAllocations of Numba's runtime (alloc, free, mi_alloc, mi_free):")
    for label, problem in measured_problems().items():
        none, some = (in_numba.allocations(problem, repeats) for repeats in (0, 1000))
        more = tuple(b - a for a, b in zip(none, some, strict=True))
        print(f"  {label:24s} 1000 solves {some}, less entering the loop {none}: {more}")
    if not kernel.equilibrium.targetoptions.get("_nrt", True):  # pyright: ignore[reportFunctionMemberAccess]
        print("  The kernel is compiled without that runtime: an allocation in it would be an error of compilation.")


def versions() -> None:
    gcc = subprocess.run(["gcc", "--version"], check=True, capture_output=True, text=True).stdout.splitlines()[0]
    info = Path("/proc/cpuinfo")
    model = next((x for x in info.read_text().splitlines() if x.startswith("model name")), "") if info.exists() else ""
    print(f"{platform.machine()}, {model.partition(': ')[2] or platform.processor()}, {os.cpu_count()} cores,", end=" ")
    print(f"LLVM names it {binding.get_host_cpu_name()}; {gcc};")
    print(f"Python {platform.python_version()}, NumPy {np.__version__}, Numba {numba.__version__},", end=" ")
    print(f"LLVM {'.'.join(map(str, binding.llvm_version_info))}, tendonrod {tendonrod.__version__}")


def main() -> None:
    if shutil.which("gcc") is None:
        sys.exit("This benchmark compiles a C program and needs gcc, which was not found.")
    versions()
    compiled()
    in_numba = InNumba()
    with tempfile.TemporaryDirectory() as folder:
        builds = {name: InC(flags, Path(folder)) for name, flags in BUILDS.items()}
        compare_answers(builds, in_numba)
        compare_times(builds, in_numba)
    show_crossing(in_numba)
    show_growth(in_numba)
    show_allocations(in_numba)


if __name__ == "__main__":
    main()
