// The labelling API. Two things can go wrong: Pebble refuses, or it is not reached.

const PATIENCE_MS = 10_000;

const ELSEWHERE = "Another data folder is served here now. Reload the page to label its run of this name.";

/** What Pebble says no with to what it understood: no such lease, answered already, does not fit. */
const REFUSING = new Set([404, 409, 422]);

/** What is not there for good when an answer or a retraction names it. */
const ITS_OWN = new Set(["lease_id", "answer_id"]);

/** Pebble understood and said no: trying again changes nothing. */
export class Refusal extends Error {
  /** @param {string} reason @param {{status?: number, field?: string}} [blame] */
  constructor(reason, { status, field } = {}) {
    super(reason);
    Object.assign(this, { status, field });
  }

  /** Whether the run itself is not here. */
  get ofRun() {
    return this.status === 404 && !ITS_OWN.has(this.field);
  }
}

/** Pebble did not answer, or could not, or something before it did (its gate, a proxy): trying again may help. */
export class Unreachable extends Error {
  /** @param {string} cause for whoever debugs; people read the same whatever it was */
  constructor(cause) {
    super("Pebble does not answer; try again in a moment.", { cause });
  }
}

/** Not signed in any more: the answer is kept until somebody signs in again. */
export class SignedOut extends Unreachable {
  message = "Signed out: open the link with the token again.";
}

export class Api {
  #turn = 0;

  /** @param {string} run @param {string} life the run's name and beginning */
  constructor(run, life) {
    this.base = `/api/runs/${encodeURIComponent(run)}`;
    this.life = life;
  }

  queue = () => this.#call("GET", `${this.base}/queue`);
  lease = (count) => this.#call("POST", `${this.base}/leases`, { count });
  answer = (body) => this.#record(`${this.base}/answers`, body);
  retract = (answerId, body) => this.#record(`${this.base}/answers/${answerId}/retract`, body);
  beNamed = (name) => this.#call("PUT", "/api/labeller", { name });

  /** Give a pair back while the page goes away, when no reply can be waited for. */
  releaseOnLeaving(leaseId) {
    navigator.sendBeacon(`${this.base}/leases/${leaseId}/release`);
  }

  /** A server on another data folder knows no such run, and so nothing of it: that is not said of this answer. */
  async #record(path, body) {
    const reply = await this.#call("POST", path, body).catch((error) => {
      throw error.ofRun ? new Unreachable(error.message) : error;
    });
    if (!reply.queue) throw new Unreachable("a reply that is not Pebble's");
    return reply;
  }

  /** The reply's JSON with `turn`, the order in which calls were made: replies may overtake each other. */
  async #call(method, path, body) {
    const turn = ++this.#turn;
    const reply = await this.#fetch(path, {
      method,
      headers: body && { "Content-Type": "application/json" },
      body: body && JSON.stringify(body),
      signal: AbortSignal.timeout(PATIENCE_MS),
    });
    const said = await reply.json().catch((error) => Promise.reject(new Unreachable(error.message)));
    const life = (said.queue ?? said).life;
    // Its pairs are not to be shown here: answers to them would wait for the folder that this page is of.
    if (life && life !== this.life) throw new Refusal(ELSEWHERE, { status: 404, field: "run_id" });
    return { ...said, turn };
  }

  async #fetch(path, options) {
    const reply = await fetch(path, options).catch((error) => {
      throw new Unreachable(error.message);
    });
    if (reply.ok) return reply;
    if (reply.status === 401) throw new SignedOut("signed out");
    const said = REFUSING.has(reply.status) ? await complaintOf(reply) : undefined;
    throw said?.reason ? new Refusal(said.reason, { ...said, status: reply.status }) : new Unreachable(`${reply.status}`);
  }
}

/** In Pebble's own words; a proxy's page has none. */
async function complaintOf(reply) {
  const said = await reply.json().catch(() => null);
  return said?.detail?.[0];
}
