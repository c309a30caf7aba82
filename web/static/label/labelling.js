// What a key does: an answer leaves for the outbox and the next pair moves at once; undo turns that round.

import { newId } from "./ids.js";

/** A key sooner after a pair's first frame was meant for the pair before. */
const GUARD_MS = 150;

/** Fires `answered` {pressed, milliseconds} and `undone` {pressed}. */
export class Labelling extends EventTarget {
  #shown = null;
  /** Version of the goal card on the page. */
  goal = undefined;

  constructor({ queue, outbox, history, player }) {
    super();
    Object.assign(this, { queue, outbox, history, player });
  }

  /** Put a decoded pair on screen. The marks let anybody measure the time from a key to the next pair. */
  show(pair) {
    this.#shown = null;
    this.player.show(pair, () => {
      this.#shown = { pair, at: performance.now(), moment: new Date().toISOString() };
      performance.mark("pebble:shown");
    });
  }

  /** @param {string} pressed @param {number} at when, on the page's clock */
  press(pressed, at) {
    const shown = this.#shown;
    if (!shown || shown.pair !== this.queue.head || at - shown.at < GUARD_MS) return;
    performance.mark("pebble:key", { startTime: at });
    this.#shown = null;
    const answerId = newId();
    this.history.push({ answerId, pressed, pair: shown.pair });
    this.outbox.add(this.#item(answerId, pressed, shown));
    this.queue.take();
    this.dispatchEvent(new CustomEvent("answered", { detail: { pressed, milliseconds: at - shown.at } }));
  }

  #item(id, pressed, { pair, moment }) {
    return {
      kind: "answer",
      id,
      lease_id: pair.leaseId,
      lease_of: pair.leaseOf,
      retracted: pair.retracted,
      seen: pair.seen,
      pressed,
      shown_at: moment,
      goal: this.goal,
    };
  }

  /** Take the latest answer back and show its pair again; false when there is none. */
  undo() {
    const entry = this.history.pop();
    if (!entry) return false;
    // An answer that may have left is taken back by the server; the pair is shown before that has answered.
    if (!this.outbox.cancel(entry.answerId)) this.#retract(entry);
    this.queue.putBack(entry.pair);
    this.dispatchEvent(new CustomEvent("undone", { detail: { pressed: entry.pressed } }));
    return true;
  }

  #retract({ answerId, pressed, pair }) {
    pair.leaseId = null;
    pair.leaseOf = newId();
    pair.retracted = answerId;
    this.outbox.add({ kind: "retract", id: pair.leaseOf, answer_id: answerId, seen: pair.seen, pressed });
  }

  /** A retraction brought its pair's new lease, perhaps for an answer that already waits for it. */
  resolve(retractionId, leaseId) {
    this.outbox.resolve(retractionId, leaseId);
    this.queue.resolve(retractionId, leaseId);
    this.history.resolve(retractionId, leaseId);
    this.queue.exclude(this.outbox.items.filter((item) => item.kind === "answer").map((item) => item.lease_id));
  }

  /** The server did not want that: whatever hung on it goes too. */
  refuse(item) {
    this.history.forget(item.id);
    if (item.kind === "retract") this.queue.drop((pair) => pair.leaseOf === item.id);
  }
}
