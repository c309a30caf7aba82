// The pairs in front of the labeller: the first is on screen, the others are decoded ahead.

import { Refusal } from "./api.js";
import { Pair } from "./pair.js";

const RETRY_MS = 1000;

/** Fires `head` when another pair comes to the front or the front one gets ready, `broken` when one is given up. */
export class PairQueue extends EventTarget {
  /** @type {Pair[]} */
  #pairs = [];
  /** Leases answered here or given up: a reply that was on its way must not bring them back. */
  #gone = new Set();
  #turn = 0;
  /** Leases whose clips this browser could not show. */
  #broken = new Set();
  /** Whether nothing else is lent than those. */
  onlyBroken = false;

  get head() {
    return this.#pairs[0];
  }

  get length() {
    return this.#pairs.length;
  }

  get leaseIds() {
    return this.#pairs.map((pair) => pair.leaseId).filter((id) => id !== null);
  }

  /** Leases that are answered already, by answers still to be sent. */
  exclude(leaseIds) {
    for (const id of leaseIds) if (id !== null) this.#gone.add(id);
    if (this.#pairs.some((pair) => this.#gone.has(pair.leaseId))) this.drop((pair) => this.#gone.has(pair.leaseId));
  }

  /**
   * Take over what the server says this labeller holds. The pair on screen stays, unless `keepHead` is false:
   * an answer to it still counts.
   */
  accept({ leases, turn }, { keepHead = true } = {}) {
    if (turn < this.#turn) return;
    this.#turn = turn;
    this.onlyBroken = leases.length > 0 && leases.every((lease) => this.#broken.has(lease.lease_id));
    const offered = leases.filter((lease) => !this.#gone.has(lease.lease_id)).map((lease) => this.#known(lease));
    const stays = (pair) => offered.includes(pair) || pair.leaseId === null || (keepHead && pair === this.head);
    const before = this.#pairs;
    this.#pairs = [...before.filter(stays), ...offered.filter((pair) => !before.includes(pair))];
    for (const pair of before) if (!this.#pairs.includes(pair)) pair.close();
    this.#prepare();
  }

  /** The pair we have of that query, under its present lease, or a new one. */
  #known(lease) {
    const found = this.#pairs.find((pair) => pair.queryId === lease.query_id && pair.left.url === lease.left.url);
    if (!found) return new Pair(lease);
    found.leaseId = lease.lease_id;
    found.leaseOf = null;
    return found;
  }

  /** Remove and return the pair at the front. */
  take() {
    const pair = this.#pairs.shift();
    if (pair?.leaseId != null) this.#gone.add(pair.leaseId);
    this.#prepare();
    return pair;
  }

  /** A pair whose answer was taken back comes to the front. */
  putBack(pair) {
    this.#gone.delete(pair.leaseId);
    this.#pairs = [pair, ...this.#pairs.filter((other) => other.queryId !== pair.queryId)];
    this.#prepare();
  }

  /** A retraction brought its lease. */
  resolve(retractionId, leaseId) {
    for (const pair of this.#pairs.filter((pair) => pair.leaseOf === retractionId)) {
      pair.leaseId = leaseId;
      pair.leaseOf = null;
    }
  }

  /** Forget the pairs that match; they are no longer ours to answer. */
  drop(matches) {
    const lost = this.#pairs.filter(matches);
    this.#pairs = this.#pairs.filter((pair) => !lost.includes(pair));
    for (const pair of lost) pair.close();
    this.#prepare();
  }

  #prepare() {
    for (const pair of this.#pairs) if (!pair.ready) this.#load(pair);
    this.dispatchEvent(new Event("head"));
  }

  async #load(pair) {
    try {
      await pair.load();
      if (pair === this.head) this.dispatchEvent(new Event("head"));
    } catch (error) {
      this.#failed(pair, error);
    }
  }

  #failed(pair, error) {
    if (!this.#pairs.includes(pair)) return;
    if (!(error instanceof Refusal)) {
      setTimeout(() => this.#pairs.includes(pair) && this.#load(pair), RETRY_MS);
      return;
    }
    if (pair.leaseId !== null) this.#gone.add(pair.leaseId);
    this.#broken.add(pair.leaseId);
    this.drop((other) => other === pair);
    this.dispatchEvent(new CustomEvent("broken", { detail: error.message }));
  }
}
