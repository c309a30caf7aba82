// Answers and retractions on their way to the server: one after the other, kept by the browser until the server
// has them. Each has an id of its own, so that sending one again changes nothing.

import { Refusal, SignedOut } from "./api.js";

/**
 * Under this and its id the browser keeps what of a run is unsent. Its life is its name and its beginning: another
 * data folder may have a run of that name, which gets none of these answers.
 */
export const unsentOf = (life) => `pebble:outbox:${life}:`;

const FIRST_RETRY_MS = 500;
const LAST_RETRY_MS = 15_000;

/**
 * @typedef {{kind: "answer", id: string, lease_id: number | null, lease_of: string | null, retracted: string | null,
 *   seen: string[], pressed: string, shown_at: string, goal: number | undefined, tried?: boolean}} AnswerItem
 * @typedef {{kind: "retract", id: string, answer_id: string, seen: string[], pressed: string, tried?: boolean}} RetractItem
 * @typedef {AnswerItem | RetractItem} Item
 */

/** Fires `sent` {item, reply}, `refused` {item, error} and `change`. */
export class Outbox extends EventTarget {
  #draining = false;
  #wake = () => {};
  failures = 0;
  signedOut = false;

  /** @param {import("./storage.js").KeptItems} kept @param {(item: Item) => Promise<any>} send */
  constructor(kept, send) {
    super();
    this.kept = kept;
    this.send = send;
    addEventListener("online", () => this.retryNow());
  }

  /** @returns {Item[]} */
  get items() {
    return this.kept.all;
  }

  add(item) {
    this.kept.put(item);
    this.drain();
  }

  /** Take an answer back before it was ever sent; false once it may have reached the server. */
  cancel(id) {
    const found = this.items.find((item) => item.id === id);
    if (!found || found.tried) return false;
    this.#remove(id);
    return true;
  }

  /** A retraction brought the lease under which a later answer was given. */
  resolve(retractionId, leaseId) {
    for (const item of this.items.filter((item) => item.lease_of === retractionId)) {
      this.kept.put({ ...item, lease_id: leaseId, lease_of: null });
    }
  }

  retryNow() {
    this.#wake();
  }

  /** Send everything there is; one call at a time does it. */
  async drain() {
    this.dispatchEvent(new Event("change"));
    if (this.#draining) return;
    this.#draining = true;
    while (this.items.length) await this.#sendFirst();
    this.#draining = false;
    this.#reached(); // by another tab, if not by this one
  }

  async #sendFirst() {
    const item = this.items[0];
    this.kept.put({ ...item, tried: true });
    try {
      const reply = await this.send(item);
      this.#reached();
      this.#remove(item.id);
      this.dispatchEvent(new CustomEvent("sent", { detail: { item, reply } }));
    } catch (error) {
      await this.#failed(item, error);
    }
    this.dispatchEvent(new Event("change"));
  }

  #reached() {
    const changes = this.failures > 0;
    this.failures = 0;
    this.signedOut = false;
    if (changes) this.dispatchEvent(new Event("change"));
  }

  async #failed(item, error) {
    if (error instanceof Refusal) {
      this.#reached();
      this.#remove(item.id);
      this.dispatchEvent(new CustomEvent("refused", { detail: { item, error } }));
      return;
    }
    this.failures += 1;
    this.signedOut = error instanceof SignedOut;
    this.dispatchEvent(new Event("change"));
    await this.#pause(Math.min(LAST_RETRY_MS, FIRST_RETRY_MS * 2 ** (this.failures - 1)));
  }

  /** Wait, a little more or less than asked so that several pages do not come in step; `retryNow` ends it. */
  #pause(milliseconds) {
    return new Promise((resolve) => {
      this.#wake = resolve;
      setTimeout(resolve, milliseconds * (0.75 + Math.random() / 2));
    });
  }

  #remove(id) {
    this.kept.remove(id);
    this.dispatchEvent(new Event("change"));
  }
}
