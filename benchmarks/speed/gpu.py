"""`python -m benchmarks.speed.gpu`: updates a second on a CUDA machine that has nothing but PyTorch and NumPy.

Each size is measured with autograd and with the update by hand, launched kernel by kernel and captured as one
graph, in float32 and with products in bfloat16. Where dm_control is there too, the whole loop follows, beside the
environment alone. `--device cpu` tries the command out.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, cast

import torch

from trainer.agents.on_gpu import CapturedUpdate
from trainer.agents.sac import SACAgent
from trainer.agents.sac_autograd import AutogradUpdate
from trainer.agents.sac_by_hand import UpdateByHand
from trainer.randomness import Randomness

OBSERVATION, ACTION, LIVED = 24, 6, 100_000
SIZES = ((256, 256), (1024, 1024))
"""Width of both layers, and batch."""
PRECISIONS = (torch.float32, torch.bfloat16)
ROUNDS = 5


@dataclass(frozen=True)
class Settings:
    """What a run's configuration says of its agent, without the package that checks configurations."""

    width: int
    batch_size: int
    depth: int = 2
    layer_norm: bool = False
    discount: float = 0.99
    learning_rate: float = 5e-4
    initial_temperature: float = 0.1
    temperature_learning_rate: float = 1e-4
    target_rate: float = 0.005
    target_every: int = 2
    updates_per_step: int = 1


def agent(
    width: int, batch: int, device: torch.device, precision: torch.dtype, *, normalised: bool = False
) -> SACAgent:
    """A learner whose buffer holds noise."""
    settings = cast("Any", Settings(width, batch, layer_norm=normalised))
    made = SACAgent(settings, OBSERVATION, ACTION, LIVED, Randomness(0), device, precision)
    made.buffer.table.normal_(generator=Randomness(1).torch("rows", device)).clamp_(-1, 1)
    made.buffer.not_terminated.fill_(1.0)
    made.buffer.added = LIVED
    return made


def contestants(width: int, batch: int, device: torch.device) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Ways of making one update of agents that are alike."""
    plain = agent(width, batch, device, torch.float32)
    plain._update = AutogradUpdate(plain)
    yield "autograd, float32", plain.update
    for precision in PRECISIONS:
        name = str(precision).removeprefix("torch.")
        by_hand = agent(width, batch, device, precision)
        by_hand._update = UpdateByHand(by_hand, precision)
        yield f"by hand, {name}", by_hand.update
        if device.type == "cuda":
            yield f"captured, {name}", agent(width, batch, device, precision).update


def finish(device: torch.device) -> None:
    if device.type == "cuda":
        torch.cuda.synchronize(device)


def per_second(work: Callable[[], Any], device: torch.device, seconds: float) -> float:
    """Units a second, launched without waiting for one another."""
    for _ in range(2 * CapturedUpdate.PLAINLY):
        work()
    finish(device)
    began, count = time.perf_counter(), 0
    while time.perf_counter() - began < seconds:
        for _ in range(10):
            work()
        finish(device)
        count += 10
    return count / (time.perf_counter() - began)


def largest_difference(device: torch.device, updates: int = 20) -> float:
    """Between the weights after some captured updates and after as many plain ones, relative, in float32."""
    captured = agent(256, 256, device, torch.float32)
    plain = agent(256, 256, device, torch.float32)
    plain._update = AutogradUpdate(plain)
    for _ in range(updates):
        captured.update()
        plain.update()
    found, expected = captured.critic.twins.flat.detach(), plain.critic.twins.flat.detach()
    return float((found - expected).abs().max() / expected.abs().max())


def table(device: torch.device, seconds: float) -> None:
    for width, batch in SIZES:
        print(f"\n| SAC update, 2×{width}, batch {batch} | updates/s | × autograd |\n|---|---|---|")
        ways = dict(contestants(width, batch, device))
        rounds = [
            {name: per_second(way, device, seconds) for name, way in ways.items()} for _ in range(ROUNDS)
        ]
        for name in ways:
            rate = statistics.median(speeds[name] for speeds in rounds)
            times = statistics.median(speeds[name] / speeds["autograd, float32"] for speeds in rounds)
            print(f"| {name} | {rate:.4g} | {times:.2f} |", flush=True)


def whole_loop(device: torch.device, seconds: float) -> None:
    """Steps a second of training, and of its environment alone, where all that a run needs is installed."""
    try:
        from benchmarks.speed.loop import Stepper, stepping_alone
    except ModuleNotFoundError as missing:
        print(f"\n{missing.name} is missing here: no measurement of the whole loop")
        return

    print("\n| walker-walk, one environment | steps/s |\n|---|---|")
    for profile in ("laptop", "paper"):
        stepper = Stepper("walker-walk", exploring=False, precision="auto", profile=profile, device=device)
        print(f"| training, {profile} profile | {per_second(stepper, device, seconds):.4g} |")
        alone = per_second(stepping_alone(stepper), device, seconds)
        print(f"| its environment alone, {profile} profile | {alone:.4g} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--device", default="cuda", choices=["cuda", "cpu"])
    parser.add_argument("--seconds", type=float, default=2.0, help="of each measurement")
    chosen = parser.parse_args()
    if chosen.device == "cuda" and not torch.cuda.is_available():
        raise SystemExit("no GPU that PyTorch can use; `--device cpu` tries the command out")
    device = torch.device(chosen.device)
    name = torch.cuda.get_device_name(device) if device.type == "cuda" else "CPU"
    print(f"{name}, torch {torch.__version__}")
    print(
        f"weights after 20 updates, by hand against autograd: {largest_difference(device):.1e} apart, relative"
    )
    table(device, chosen.seconds)
    whole_loop(device, chosen.seconds)


if __name__ == "__main__":
    main()
