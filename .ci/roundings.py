"""The numerical tests again under other roundings: settings that change the last digit of sin, exp and dot products.

    python .ci/roundings.py          # all legs
    python .ci/roundings.py --list   # the settings and their digests, no tests

What numpy, the C library and OpenBLAS compute with depends on the processor; the variables of `settings` take parts of it
away. Which of them change anything is different on every machine, and is measured: a setting whose digest of many values is
the default's, or that of a leg before it, would test nothing and is skipped. Of the others the first few are run. None at
all is a failure on x86, where there always is one.
"""

import hashlib
import math
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

LEGS = 2
NUMERICAL = tuple(  # where figures are held against references, and where a last digit may decide: locks, roots, cells
    f"tests/{name}"
    for name in (
        *("extremes", "estimates", "oracle", "references", "validation", "bondgraph/motion", "bondgraph/test_reduction.py"),
        *("numerics", "mechanisms", "linkages", "machine", "regime", "sizing"),
    )
)
ROOT = Path(__file__).parents[1]
X86 = platform.machine().lower() in ("x86_64", "amd64", "i686", "i386")
LIBM = ",".join(f"-{part}{old}" for part in ("AVX2", "FMA", "FMA4", "AVX512F") for old in ("", "_Usable"))  # and before 2.33


def settings() -> Iterator[dict[str, str]]:
    """What could change the roundings here, the best first."""
    if not X86:
        yield from ({"OPENBLAS_CORETYPE": core} for core in ("ARMV8", "CORTEXA57", "NEOVERSEN1"))
        return
    libm = {"GLIBC_TUNABLES": f"glibc.cpu.hwcaps={LIBM}"}
    found = " ".join(part for part in __cpu_dispatch__ if __cpu_features__.get(part))  # numpy warns of any other
    plain = {"NPY_DISABLE_CPU_FEATURES": found} if found else {}
    old, older, oldest = ({"OPENBLAS_CORETYPE": core} for core in ("Sandybridge", "Nehalem", "Prescott"))
    yield plain | libm | oldest
    if __cpu_features__.get("AVX2") and __cpu_features__.get("FMA3"):  # OpenBLAS takes a name on trust
        yield plain | {"OPENBLAS_CORETYPE": "Haswell"}
    if __cpu_features__.get("AVX"):
        yield plain | old
    yield from (libm | older, plain | older, plain | libm, plain, libm)


def digest() -> str:
    """Of many values of sin, exp and dot products: equal where every bit of them is."""
    random = np.random.default_rng(1)
    x, y = random.uniform(-50.0, 50.0, 20_000), random.uniform(-5.0, 5.0, 20_000)
    some = y[:2000].tolist()
    kinds = {
        "sin": (np.sin(x), np.cos(x), [math.sin(v) for v in some]),
        "exp": (np.exp(y), np.log(np.abs(x)), [math.exp(v) for v in some]),
        "dot": ([x[:n] @ y[:n] for n in range(1, 400)], x[:4096].reshape(64, 64) @ y[:4096].reshape(64, 64)),
    }
    return "  ".join(f"{kind} {_hash(values)}" for kind, values in kinds.items())


def _hash(values: tuple[object, ...]) -> str:
    return hashlib.sha256(b"".join(np.asarray(part).tobytes() for part in values)).hexdigest()[:8]


def digest_under(setting: dict[str, str]) -> str:
    """The digest of a process with this setting; what ended it, where it died."""
    run = subprocess.run(
        [sys.executable, __file__, "--digest"], env=os.environ | setting, capture_output=True, text=True, check=False
    )
    return run.stdout.strip() if run.returncode == 0 else f"dies: {(run.stderr.strip().splitlines() or ['?'])[-1]}"


def legs() -> Iterator[dict[str, str]]:
    """The settings that are worth a run, each told with its digest, and what is skipped told too."""
    default = digest_under({})
    print(f"the default\n    {default}")
    seen, chosen = {default: "the default"}, 0
    for setting in settings():
        found = digest_under(setting)
        if found.startswith("dies"):
            verdict = "skipped: this machine cannot run it"
        elif found in seen:
            verdict = f"skipped: the same as {seen[found]}"
        elif chosen == LEGS:
            verdict = f"skipped: {LEGS} legs are enough"
        else:
            chosen += 1
            verdict = seen[found] = f"leg {chosen}"
            yield setting
        print(f"{told(setting)}\n    {found}  {verdict}", flush=True)


def told(setting: dict[str, str]) -> str:
    """A setting as a shell takes it."""
    return " ".join(f"{name}='{value}'" for name, value in setting.items())


def numerical_tests(setting: dict[str, str]) -> int:
    """Run them; pytest's exit code."""
    command = [sys.executable, "-m", "pytest", *NUMERICAL]
    return subprocess.run(command, cwd=ROOT, env=os.environ | setting, stdin=subprocess.DEVNULL, check=False).returncode


def main() -> int:
    """All legs; how many failed."""
    chosen = list(legs())
    if not chosen:
        print("NO OTHER ROUNDING was found on this machine: the numerical tests ran with its own only")
        return int(X86 and "CI" in os.environ)
    failed = 0
    for k, setting in enumerate([] if "--list" in sys.argv else chosen, 1):
        print(f"\nleg {k}: {told(setting)}\n    {digest_under(setting)}", flush=True)
        failed += numerical_tests(setting) != 0
    return failed


if __name__ == "__main__":
    if "--digest" in sys.argv:
        print(digest())
    else:
        sys.exit(main())
