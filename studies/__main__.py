"""`python -m studies [NAME ...]`: run the studies and print their figures."""

from __future__ import annotations

import importlib
import sys

STUDIES = (
    "coverage",
    "use_coverage",
    "enough",
    "fleets",
    "fleet_batches",
    "budget_coverage",
    "rate_vector_coverage",
    "indexing",
    "single_outputs",
    "conformity",
    "drift_coverage",
    "drift_shapes",
    "table_clock",
    "figures_agree",
    "page_figures",
    "hand_turns",
    "poses",
    "triads",
    "accelerometer_temperature",
    "joint_recordings",
    "criticism",
    "diagnosis",
    "designed_campaigns",
    "laws",
    "law_experiments",
    "rest_loops",
    "scale_loops",
    "rest_verdicts",
    "rest_peers",
    "real",
    "public_records",
    "profiles",
    "course_time",
    "crash_recovery",
    "process_kill",
    "process_pairs",
    "benches",
    "busy_campaigns",
    "stops",
    "stop_sequences",
    "page_stops",
    "page_stop_cases",
    "faults",
    "attacks",
    "damaged_imports",
    "forensics",
    "blind_forensics",
    "endurance",
    "log_size",
    "c_points",
)


def main(names: list[str]) -> int:
    """Run the named studies, or all."""
    unknown = [name for name in names if name not in STUDIES]
    if unknown:
        print(f"no study {unknown[0]!r} (there are {', '.join(STUDIES)})", file=sys.stderr)
        return 2
    for name in names or STUDIES:
        module = importlib.import_module(f"studies.{name}")
        print(f"\n== {name}: {(module.__doc__ or '').splitlines()[0]}", flush=True)
        found = module.run()
        print(found if isinstance(found, str) else figures(found), flush=True)
    return 0


def figures(found: dict[str, float]) -> str:
    """Return figures as lines."""
    return "\n".join(f"   {key:28} {value:.4g}" for key, value in found.items())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
