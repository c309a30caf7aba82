"""A run's own process: `python -m trainer.process RUN ATTEMPT DATA [ARTIFACTS_URL]`."""

from __future__ import annotations

import sys
from pathlib import Path

from labels_db.claims import Claim
from labels_db.data_folder import DataFolder
from labels_db.models import RunState
from labels_db.runs import config_of, get_run
from trainer.threads import wait_asleep


def main(arguments: list[str]) -> int:
    run_id, attempt, data, *url = arguments
    # What follows in the run's log is this attempt's. PyTorch takes seconds to load: who is coming is said before.
    print(f"--- attempt {attempt} of {run_id} ---", flush=True)
    folder = DataFolder(Path(data), url[0] if url else None)
    with folder.open_database() as database, database.read() as session:
        wait_asleep(config_of(get_run(session, run_id)))
    from trainer.attempt import live_in_this_process

    state = live_in_this_process(folder, Claim(run_id, int(attempt)))
    return 1 if state is RunState.FAILED else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
