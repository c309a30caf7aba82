"""What speeds were measured on."""

from __future__ import annotations

import json
import os
import re
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from trainer.experiments.provenance import versions


def machine(peers: Path | None) -> dict[str, Any]:
    """The processor, our versions and, where there are peers, theirs."""
    found = versions()
    if peers is not None:
        listed = subprocess.run(
            [peers, "-m", "pip", "list", "--format=json"], capture_output=True, check=True
        )
        wanted = {"stable_baselines3", "sbx-rl", "jax", "jaxlib", "torch"}
        found |= {
            f"peers' {p['name']}": p["version"] for p in json.loads(listed.stdout) if p["name"] in wanted
        }
    return {"processor": processor(), **found}


def differences(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    """In what two machines differ, but for the commit that was run on them."""
    return sorted(key for key in {*one, *other} - {"commit"} if one.get(key) != other.get(key))


def processor() -> str:
    """The processor's name and how many of its cores this process may use."""
    text = Path("/proc/cpuinfo").read_text(encoding="utf-8") if Path("/proc/cpuinfo").exists() else ""
    found = re.search(r"model name\s*:\s*(.*)", text)
    return f"{found.group(1) if found else 'unknown'}, {len(os.sched_getaffinity(0))} cores"
