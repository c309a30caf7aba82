// A value kept by the browser under a key; where it keeps nothing (private windows), for this page only.

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
