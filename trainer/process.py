"""A run's own process: `python -m trainer.process RUN ATTEMPT DATA [ARTIFACTS_URL]`."""

from __future__ import annotations

import sys
from pathlib import Path

from labels_db.claims import Claim
from labels_db.models import RunState


def main(arguments: list[str]) -> int:
    run_id, attempt, data, *url = arguments
    print(
        f"--- attempt {attempt} of {run_id} ---", flush=True
    )  # what follows in the run's log is this attempt's
    from trainer.attempt import (
        live_in_this_process,
    )  # imports torch: seconds in which the log says who is coming

    state = live_in_this_process(Path(data), url[0] if url else None, Claim(run_id, int(attempt)))
    return 1 if state is RunState.FAILED else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
