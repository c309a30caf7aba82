// One pair of clips: how it was lent, and its two sprite sheets, decoded before they are needed.

import { Refusal, Unreachable } from "./api.js";

/**
 * @typedef {{url: string, frames: number, rows: number, columns: number, width: number, height: number,
 *   duration: number, times: number[]}} Clip
 */

const PATIENCE_MS = 30_000;
const TRIES = 3;

export class Pair {
  #loading = null;
  #undecoded = 0;
  /** @type {{left: ImageBitmap, right: ImageBitmap} | null} */
  sheets = null;

  /** @param {{lease_id: number | null, lease_of?: string | null, retracted?: string | null, query_id: number, left: Clip, right: Clip}} lease */
  constructor(lease) {
    this.leaseId = lease.lease_id;
    /** The retraction that will bring a new lease, while `leaseId` is null. */
    this.leaseOf = lease.lease_of ?? null;
    /** The answer that it takes back. */
    this.retracted = lease.retracted ?? null;
    this.queryId = lease.query_id;
    this.left = lease.left;
    this.right = lease.right;
  }

  get ready() {
    return this.sheets !== null;
  }

  /** What is on screen, left and right: an answer says so, whoever the browser takes itself for when it is sent. */
  get seen() {
    return [this.left.url, this.right.url];
  }

  /** Fetch and decode both sheets, once. */
  load() {
    this.#loading ??= this.#decode().finally(() => (this.#loading = null));
    return this.ready ? Promise.resolve() : this.#loading;
  }

  async #decode() {
    const blobs = await Promise.all([fetched(this.left.url), fetched(this.right.url)]);
    const [left, right] = await Promise.all(blobs.map((blob) => createImageBitmap(blob))).catch(() => {
      throw this.#unreadable();
    });
    this.sheets = { left, right };
  }

  /** A device short of memory may manage later; a clip that is broken stays so. */
  #unreadable() {
    this.#undecoded += 1;
    const reason = "its clip cannot be read";
    return this.#undecoded < TRIES ? new Unreachable(reason) : new Refusal(reason);
  }

  /** Free the decoded sheets; they can be loaded again. */
  close() {
    this.sheets?.left.close();
    this.sheets?.right.close();
    this.sheets = null;
  }

  toJSON() {
    const { leaseId, leaseOf, retracted, queryId, left, right } = this;
    return { lease_id: leaseId, lease_of: leaseOf, retracted, query_id: queryId, left, right };
  }
}

async function fetched(url) {
  const reply = await fetch(url, { signal: AbortSignal.timeout(PATIENCE_MS) }).catch((error) => {
    throw new Unreachable(error.message);
  });
  if (reply.status === 404) throw new Refusal("its clip is gone");
  if (!reply.ok) throw new Unreachable(`${url}: ${reply.status}`);
  return reply.blob().catch((error) => {
    throw new Unreachable(error.message);
  });
}
