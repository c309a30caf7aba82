// What a run has measured, kept complete: asks for what is new, and for everything after a restart.
import { columns } from "./plot.js";

const NAMES = ["episode_return", "steps_per_second"];

export class Curves {
  constructor(run) {
    this.base = `/api/runs/${run}`;
    this.forget();
  }

  forget() {
    this.attempt = null;
    this.since = -1;
    this.series = new Map(NAMES.map((name) => [name, new Map()]));
  }

  /** Ask once; resolves to whether anything may have changed. */
  async refresh() {
    const [metrics, evaluations, fits] = await Promise.all([
      this.#get(`metrics?since=${this.since}&names=${NAMES.join(",")}`),
      this.#get("evaluations"),
      this.#get("fits"),
    ]);
    if (this.attempt !== null && metrics.attempt !== this.attempt) {
      // The run went on from a checkpoint: what it had measured after that is gone.
      this.forget();
      return this.refresh();
    }
    this.attempt = metrics.attempt;
    for (const [name, { steps, values }] of Object.entries(metrics.series)) {
      steps.forEach((step, index) => this.series.get(name).set(step, values[index]));
      this.since = Math.max(this.since, steps.at(-1));
    }
    this.series.set("evaluation", new Map(evaluations.map((e) => [e.step, e.mean_return])));
    this.series.set("training", new Map(fits.map((f) => [f.step, f.training_accuracy])));
    this.series.set("fresh", new Map(fits.map((f) => [f.step, f.fresh_accuracy])));
    return true;
  }

  /** Columns for uPlot: the steps at which any of the named was measured, then each one's values there. */
  columns(names) {
    return columns(names.map((name) => this.series.get(name) ?? new Map()));
  }

  async #get(what) {
    const reply = await fetch(`${this.base}/${what}`);
    if (!reply.ok) throw new Error(`${what}: ${reply.status}`);
    return reply.json();
  }
}
