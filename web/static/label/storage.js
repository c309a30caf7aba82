// What the browser keeps; where it keeps nothing (private windows), for this page only.

/** A value under a key. */
export class Kept {
  #memory;
  #works = true;

  /** @param {Storage} storage @param {string} key @param {any} initial */
  constructor(storage, key, initial) {
    this.storage = storage;
    this.key = key;
    this.#memory = initial;
  }

  get() {
    try {
      const text = this.storage.getItem(this.key);
      return text === null || !this.#works ? this.#memory : JSON.parse(text);
    } catch {
      return this.#memory;
    }
  }

  set(value) {
    this.#memory = value;
    try {
      this.storage.setItem(this.key, JSON.stringify(value));
      this.#works = true;
    } catch {
      this.#works = false; // full or forbidden: the copy in memory serves as long as the page lives
    }
  }
}

/**
 * Things with an id, in the order in which they came, each under a key of its own. A tab hears late of what another
 * one wrote: with one list under one key it would write back what it had seen, without what was added since.
 */
export class KeptItems {
  /** By id, what the browser would not keep. */
  #here = new Map();

  /** @param {Storage} storage @param {string} prefix of the keys */
  constructor(storage, prefix) {
    this.storage = storage;
    this.prefix = prefix;
  }

  get all() {
    return [...this.#known.values()].sort((one, other) => one.turn - other.turn).map(({ item }) => item);
  }

  /** @param {{id: string}} item takes the place of the one of that id, or comes after all others */
  put(item) {
    const known = this.#known;
    const last = Math.max(0, ...[...known.values()].map(({ turn }) => turn));
    const entry = { turn: known.get(item.id)?.turn ?? last + 1, item };
    try {
      this.storage.setItem(this.prefix + item.id, JSON.stringify(entry));
      this.#here.delete(item.id);
    } catch {
      this.#here.set(item.id, entry); // full or forbidden
    }
  }

  /** @param {string} id */
  remove(id) {
    this.#here.delete(id);
    this.storage.removeItem(this.prefix + id);
  }

  /** By id, with the turn in which it came. @returns {Map<string, {turn: number, item: any}>} */
  get #known() {
    const keys = Object.keys(this.storage).filter((key) => key.startsWith(this.prefix));
    const kept = keys.map((key) => parsed(this.storage.getItem(key))).filter((entry) => entry?.item);
    return new Map([...kept.map((entry) => [entry.item.id, entry]), ...this.#here]);
  }
}

function parsed(text) {
  try {
    return JSON.parse(text);
  } catch {
    return null; // cut off by a crash of the browser, or not ours
  }
}
