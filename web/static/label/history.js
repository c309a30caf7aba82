// What was answered here, latest last, so that it can be taken back step by step, also after a reload.

import { Pair } from "./pair.js";

const KEPT_ANSWERS = 50;
const KEPT_SHEETS = 2;

/** @typedef {{answerId: string, pressed: string, pair: Pair}} Entry */

export class History {
  /** @type {Entry[]} */
  #entries;

  /** @param {import("./storage.js").Kept} kept */
  constructor(kept) {
    this.kept = kept;
    this.#entries = kept.get().map((entry) => ({ ...entry, pair: new Pair(entry.pair) }));
  }

  get length() {
    return this.#entries.length;
  }

  /** @param {Entry} entry */
  push(entry) {
    this.#entries = [...this.#entries, entry].slice(-KEPT_ANSWERS);
    // A decoded pair takes some 15 MB: only the ones that undo reaches first stay decoded.
    for (const { pair } of this.#entries.slice(0, -KEPT_SHEETS)) pair.close();
    this.kept.set(this.#entries);
  }

  /** @returns {Entry | undefined} */
  pop() {
    const entry = this.#entries.pop();
    this.kept.set(this.#entries);
    return entry;
  }

  /** Forget an answer that the server refused. */
  forget(answerId) {
    this.#entries = this.#entries.filter((entry) => entry.answerId !== answerId);
    this.kept.set(this.#entries);
  }

  /** A retraction brought its lease. */
  resolve(retractionId, leaseId) {
    for (const { pair } of this.#entries.filter((entry) => entry.pair.leaseOf === retractionId)) {
      pair.leaseId = leaseId;
      pair.leaseOf = null;
    }
    this.kept.set(this.#entries);
  }

  clear() {
    this.#entries = [];
    this.kept.set([]);
  }
}
