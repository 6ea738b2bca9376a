#!/usr/bin/env bash
# Ten hidden effects, one after the other: simulate, import, fit, criticise, improve - and the ladder at the end.
# Criticise names each, alone or in a group with what this schedule cannot tell from it; improve adds it, and the ladder
# falls to the noise floor. Some sizes are larger than is usual: improve says so.
# Usage: examples/hidden-effects/walkthrough.sh [FOLDER]      (needs labctl on the PATH, or .venv/bin/labctl)
set -euo pipefail
folder="${1:-$(mktemp -d)}"
labctl="$(command -v labctl || echo "$(dirname "$0")/../../.venv/bin/labctl")"
mkdir -p "$folder"

walk() {
    local recipe="$1" serial="$2" model="$3" effect="$4" size="$5"
    export LABCTL_DATABASE="$folder/$effect.sqlite"
    echo "=== $effect = $size, on $recipe"
    "$labctl" simulate "$recipe" --out "$folder/$effect" --hide "$effect=$size" --sample-rate "${6:-10}"
    "$labctl" import "$folder/$effect"
    "$labctl" fit "$serial" --model "$model" >/dev/null
    "$labctl" criticise "$serial" --json >"$folder/$effect.json"
    "$labctl" criticise "$serial" | sed -n 1p
    "$labctl" improve "$serial" --add "$effect"
    "$labctl" ladder "$serial"
}

fog() { walk ojeda2000 FOG-0001 ojeda2000 "$@"; }
mems() { walk table1-x-table2 STIM-0001 yang2018 "$@" 4; }

fog scale_factor_asymmetry 2e-4
fog saturation -7e-4
fog vibration_rectification 0.004
fog rate_hysteresis 0.005
fog start_transient 6e-4
fog supply_sensitivity 0.04
fog table_rate_ripple 3e-5
fog earth_rate_tilt 0.0012
mems g_sensitivity 0.015
mems scale_factor_odd 5e-9
echo "all in $folder"
