// Keeps the queue filled and its leases alive: often while it is empty, seldom while it is full.

import { Refusal, SignedOut } from "./api.js";

export const AHEAD = 4;
const MOST = 8;

const EMPTY_MS = 500;
const SHORT_MS = 2000;
const RENEW_MS = 20_000;
const HIDDEN_MS = 3000;
const CALM_MS = 2000;
const OVER_MS = 5000;
const UNREACHED_MS = 2000;
const CALM = new Set(["queued", "starting", "paused", "silent"]);

/** Whether an answer to a pair that is not lent any more would still teach the run something. */
function wants(state) {
  return state.remaining > 0 && state.state !== "finished" && state.message?.kind !== "archived";
}

/** Fires `state` {queue}, `refused` {error}, `unreached` {signedOut}. */
export class Keeper extends EventTarget {
  #timer = 0;
  #busy = false;
  #again = false;
  #away = false;
  #nothing = false;
  #wait = EMPTY_MS;

  /** @param {{api: import("./api.js").Api, queue: import("./queue.js").PairQueue, outbox: import("./outbox.js").Outbox}} parts */
  constructor({ api, queue, outbox }) {
    super();
    Object.assign(this, { api, queue, outbox });
    document.addEventListener("visibilitychange", () => this.#visibility());
    addEventListener("pageshow", (event) => event.persisted && this.comeBack());
    addEventListener("pagehide", () => this.#leave());
  }

  /** How many leases to ask for: answers not sent yet still hold theirs. */
  get wanted() {
    const held = this.outbox.items.filter((item) => item.kind === "answer").length;
    return Math.min(MOST, AHEAD + held);
  }

  /** Ask now, and from then on by itself. */
  async poke() {
    this.#again = true;
    if (this.#busy) return;
    this.#busy = true;
    clearTimeout(this.#timer);
    while (this.#again) {
      this.#again = false;
      await this.#ask();
    }
    this.#busy = false;
    this.#askLater();
  }

  #askLater() {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.poke(), this.#wait);
  }

  /** What a reply to an answer said. */
  heard(reply, { keepHead = true } = {}) {
    this.queue.accept(reply, { keepHead: keepHead && wants(reply.queue) });
    this.#said(reply.queue);
  }

  comeBack() {
    this.#away = true;
    this.poke();
  }

  async #ask() {
    try {
      const only = document.hidden || this.#nothing;
      await (only ? this.#look() : this.#lease());
    } catch (error) {
      const detail = error instanceof Refusal ? { error } : { signedOut: error instanceof SignedOut };
      this.#wait = error instanceof Refusal ? OVER_MS : UNREACHED_MS;
      this.dispatchEvent(new CustomEvent(error instanceof Refusal ? "refused" : "unreached", { detail }));
    }
  }

  async #lease() {
    const keepHead = !this.#comesBack();
    this.heard(await this.api.lease(this.wanted), { keepHead });
  }

  /** Nothing is leased while there is nothing, nor while nobody looks: others may want it. */
  async #look() {
    const state = await this.api.queue();
    if (state.available) await (document.hidden ? this.#said(state) : this.#lease());
    else this.heard({ leases: [], queue: state, turn: state.turn }, { keepHead: !this.#comesBack() });
  }

  /** After a time away the pair on screen may be somebody else's by now, and nobody is looking at it yet. */
  #comesBack() {
    const away = this.#away;
    this.#away = document.hidden;
    return away || document.hidden;
  }

  #said(state) {
    this.#nothing = state.available === 0;
    this.#wait = this.#interval(state);
    if (!this.#busy) this.#askLater();
    this.dispatchEvent(new CustomEvent("state", { detail: state }));
  }

  #interval(state) {
    if (document.hidden) return HIDDEN_MS;
    if (this.queue.length) return this.queue.length < AHEAD ? SHORT_MS : RENEW_MS;
    if (state.message?.over) return OVER_MS;
    return CALM.has(state.message?.kind) ? CALM_MS : EMPTY_MS;
  }

  #visibility() {
    document.hidden ? this.poke() : this.comeBack();
  }

  #leave() {
    for (const id of this.queue.leaseIds) this.api.releaseOnLeaving(id);
  }
}
