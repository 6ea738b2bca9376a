"""All acts on a bench. A new one is a module beside the others and a line here."""

from __future__ import annotations

from typing import Any

from labctl.services.commands.acts.abort import ABORT
from labctl.services.commands.acts.campaign_act import CampaignAct
from labctl.services.commands.acts.check import CHECK
from labctl.services.commands.acts.confirm import CONFIRM
from labctl.services.commands.acts.live import END_LIVE_ACT, START_LIVE_ACT
from labctl.services.commands.acts.pause import PAUSE
from labctl.services.commands.acts.resume import RESUME
from labctl.services.commands.acts.start import SCHEDULE, START
from labctl.services.commands.context import BenchAct

#: Acts on one campaign, in the order of the API's description.
CAMPAIGN_ACTS: tuple[CampaignAct[Any], ...] = (ABORT, PAUSE, CONFIRM, RESUME)
_ALL: tuple[BenchAct[Any, Any], ...] = (START, SCHEDULE, *CAMPAIGN_ACTS, CHECK, START_LIVE_ACT, END_LIVE_ACT)
#: All of them by name.
BENCH_ACTS: dict[str, BenchAct[Any, Any]] = {act.name: act for act in _ALL}
