"""`make bench [NAME ...]`: run the benchmarks and print their figures."""

from __future__ import annotations

import importlib
import pkgutil
import sys

import benchmarks


def main() -> None:
    """Run every benchmark module that has a `run`, or those named on the command line."""
    wanted = set(sys.argv[1:])
    for found in pkgutil.iter_modules(benchmarks.__path__):
        if found.name == "__main__" or (wanted and found.name not in wanted):
            continue
        module = importlib.import_module(f"benchmarks.{found.name}")
        if not hasattr(module, "run"):
            continue
        print(f"\n== {found.name}: {(module.__doc__ or '').strip().splitlines()[0]}", flush=True)
        for name, value in module.run().items():
            print(f"   {name:44} {value:.4g}" if isinstance(value, float) else f"   {name:44} {value}", flush=True)


if __name__ == "__main__":
    main()
