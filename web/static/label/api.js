// The labelling API. Two things can go wrong: the server refuses, or it is not reached.

const PATIENCE_MS = 10_000;

/** The server understood and said no: trying again changes nothing. */
export class Refusal extends Error {
  /** @param {number} status @param {string} reason */
  constructor(status, reason) {
    super(reason);
    this.status = status;
  }
}

/** The server did not answer, or could not: trying again may help. */
export class Unreachable extends Error {}

/** Not signed in any more: the answer is kept until somebody signs in again. */
export class SignedOut extends Unreachable {}

export class Api {
  #turn = 0;

  /** @param {string} run */
  constructor(run) {
    this.base = `/api/runs/${encodeURIComponent(run)}`;
  }

  queue = () => this.#call("GET", `${this.base}/queue`);
  lease = (count) => this.#call("POST", `${this.base}/leases`, { count });
  answer = (body) => this.#call("POST", `${this.base}/answers`, body);
  retract = (answerId, body) => this.#call("POST", `${this.base}/answers/${answerId}/retract`, body);
  beNamed = (name) => this.#call("PUT", "/api/labeller", { name });

  /** Give a pair back while the page goes away, when no reply can be waited for. */
  releaseOnLeaving(leaseId) {
    navigator.sendBeacon(`${this.base}/leases/${leaseId}/release`);
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
    return { ...(await reply.json()), turn };
  }

  async #fetch(path, options) {
    const reply = await fetch(path, options).catch((error) => {
      throw new Unreachable(error.message);
    });
    if (reply.ok) return reply;
    if (reply.status === 401 || reply.status === 403) throw new SignedOut("signed out");
    if (reply.status >= 500 || reply.status === 429 || reply.status === 408) throw new Unreachable(`${reply.status}`);
    throw new Refusal(reply.status, await reasonOf(reply));
  }
}

async function reasonOf(reply) {
  const said = await reply.json().catch(() => ({}));
  const first = Array.isArray(said.detail) ? said.detail[0] : undefined;
  return first?.reason ?? reply.statusText;
}
