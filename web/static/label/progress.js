// "23 of 50 · 2.4 s each · about 1 min left": counted here too, so that an answer shows before it is sent.

const REMEMBERED = 20;
const LONGEST_MS = 60_000;

/** How long an answer takes this labeller, from the last few. */
export class Pace {
  /** @param {import("./storage.js").Kept} kept */
  constructor(kept) {
    this.kept = kept;
  }

  /** A pause is no judgement: longer ones are cut. */
  add(milliseconds) {
    this.kept.set([...this.kept.get(), Math.min(milliseconds, LONGEST_MS)].slice(-REMEMBERED));
  }

  /** Mean seconds per answer, once there are some. */
  get seconds() {
    const times = this.kept.get();
    return times.length < 3 ? null : times.reduce((sum, time) => sum + time, 0) / times.length / 1000;
  }
}

/** Answers that the server does not know of yet, less those taken back; "cannot tell" counts for nothing. */
export function unsentCount(items) {
  const counted = items.filter((item) => item.pressed !== "skip");
  return counted.reduce((sum, item) => sum + (item.kind === "answer" ? 1 : -1), 0);
}

export function progressText({ given, budget }, seconds) {
  const parts = [given > budget ? `${given} given, ${budget} were wanted` : `${given} of ${budget}`];
  if (seconds !== null) {
    parts.push(`${seconds.toFixed(1)} s each`);
    if (given < budget) parts.push(`about ${span((budget - given) * seconds)} left`);
  }
  return parts.join(" · ");
}

function span(seconds) {
  if (seconds < 55) return `${Math.max(5, Math.round(seconds / 5) * 5)} s`;
  return seconds < 5400 ? `${Math.round(seconds / 60)} min` : `${(seconds / 3600).toFixed(1)} h`;
}
