"""The numerical tests again under other roundings: settings that change the last digit of sin, exp and dot products.

    python .ci/roundings.py          # all legs
    python .ci/roundings.py --list   # the settings and their digests, no tests

What numpy, the C library and OpenBLAS compute with depends on the processor; the variables of `settings` take parts of it
away. Which of them change anything is different on every machine, and is measured: a setting whose digest of many values is
the default's, or that of a leg before it, would test nothing and is skipped. All kernels of OpenBLAS are tried that it knows
for the architecture, and each that the processor runs and that changes the digest is a leg; what changes sin and exp goes
with the oldest of them. No leg at all is a failure on x86, where there always is one. Each leg tells what it costs.
"""

import hashlib
import math
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

NUMERICAL = tuple(  # where figures are held against references, and where a last digit may decide: locks, roots, cells
    f"tests/{name}"
    for name in (
        *("extremes", "estimates", "oracle", "references", "validation"),
        *(f"bondgraph/test_{name}.py" for name in ("simulation", "integration", "reduction")),
        *("numerics", "mechanisms", "linkages", "machine", "regime", "sizing"),
    )
)
ROOT = Path(__file__).parents[1]
X86 = platform.machine().lower() in ("x86_64", "amd64", "i686", "i386")
LIBM = ",".join(f"-{part}{old}" for part in ("AVX2", "FMA", "FMA4", "AVX512F") for old in ("", "_Usable"))  # and before 2.33


KERNELS = (  # of OpenBLAS, the newest first; it takes a name on trust, and what cannot run here dies
    *("SapphireRapids", "Cooperlake", "SkylakeX", "Zen", "Haswell", "Excavator", "Steamroller", "Piledriver", "Bulldozer"),
    *("Sandybridge", "Bobcat", "Barcelona", "Nehalem", "Atom", "Nano", "Dunnington", "Penryn", "Core2"),
    *("Opteron_SSE3", "Opteron", "Athlon", "Prescott"),
)
ARM_KERNELS = (
    *("NEOVERSEV2", "NEOVERSEV1", "NEOVERSEN2", "NEOVERSEN1", "A64FX", "ARMV9SME", "ARMV8SVE", "VORTEX", "VORTEXM4"),
    *("TSV110", "EMAG8180", "FALKOR", "THUNDERX3T110", "THUNDERX2T99", "THUNDERX", "CORTEXX2", "CORTEXX1", "CORTEXA710"),
    *("CORTEXA510", "CORTEXA76", "CORTEXA73", "CORTEXA72", "CORTEXA57", "CORTEXA55", "CORTEXA53", "ARMV8"),
)


def settings() -> Iterator[dict[str, str]]:
    """Settings that change roundings: the oldest kernel with all else taken away, the others alone, all else alone."""
    *kernels, oldest = KERNELS if X86 else ARM_KERNELS
    found = " ".join(part for part in __cpu_dispatch__ if __cpu_features__.get(part))  # numpy warns of any other
    plain = {"NPY_DISABLE_CPU_FEATURES": found} if found else {}
    libm = {"GLIBC_TUNABLES": f"glibc.cpu.hwcaps={LIBM}"} if X86 else {}
    yield plain | libm | {"OPENBLAS_CORETYPE": oldest}
    yield from ({"OPENBLAS_CORETYPE": kernel} for kernel in kernels)
    yield plain | libm


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
    """The settings that are worth a run, each told with its digest, and what is skipped told too.

    Each kind of value (sin, exp, dot) is worth a run for each digest of its own: one that a leg has already, whatever the
    others are beside it, is no reason for another.
    """
    default = digest_under({})
    print(f"the default\n    {default}")
    seen, chosen = dict.fromkeys(default.split("  "), "the default"), 0
    for setting in settings():
        found = digest_under(setting)
        new = [kind for kind in found.split("  ") if kind not in seen]
        if found.startswith("dies"):
            verdict = "skipped: this machine cannot run it"
        elif not new:
            verdict = f"skipped: the same as {' and '.join(dict.fromkeys(seen[kind] for kind in found.split('  ')))}"
        else:
            chosen += 1
            verdict = f"leg {chosen}"
            seen |= dict.fromkeys(new, verdict)
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
        began = time.monotonic()
        failed += numerical_tests(setting) != 0
        print(f"leg {k}: {time.monotonic() - began:.0f} s", flush=True)
    return failed


if __name__ == "__main__":
    if "--digest" in sys.argv:
        print(digest())
    else:
        sys.exit(main())
