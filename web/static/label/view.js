// What the page shows besides the clips: a pair, or why there is none; progress; whether answers are saved.

const NOTE_MS = 6000;
const SAVING_MS = 400;

export class View {
  #noteTimer = 0;
  #savingTimer = 0;

  /** @param {HTMLElement} root */
  constructor(root) {
    const part = (name) => document.querySelector(`[data-${name}]`);
    this.root = root;
    this.stage = part("stage");
    this.empty = part("empty");
    this.sentence = part("sentence");
    this.goal = part("goal");
    this.progress = part("progress");
    this.saved = part("saved");
    this.note = part("note");
    this.announcer = part("announcer");
    this.undo = part("undo");
    this.clips = [...document.querySelectorAll("button.clip")];
    this.answers = [...document.querySelectorAll("button[data-press]")];
  }

  /** A pair is on screen: that query. */
  showPair(queryId) {
    this.stage.dataset.query = String(queryId);
    this.#mode("pair");
  }

  /** The next pair is on its way. */
  showWait() {
    this.#mode("wait");
  }

  /** There is no pair, for that reason. */
  showEmpty(kind, sentence) {
    this.#mode("empty");
    this.empty.dataset.kind = kind;
    if (this.sentence.textContent !== sentence) this.sentence.textContent = sentence;
  }

  #mode(mode) {
    this.root.dataset.mode = mode;
    this.stage.hidden = mode === "empty";
    this.empty.hidden = mode !== "empty";
    for (const button of this.answers) button.disabled = mode !== "pair";
  }

  setGoal(goal) {
    if (goal && this.goal.textContent !== goal.text) this.goal.textContent = goal.text;
  }

  setProgress(text) {
    this.progress.textContent = text;
  }

  setUndo(possible) {
    this.undo.disabled = !possible;
  }

  /** Say something in passing. */
  say(text) {
    clearTimeout(this.#noteTimer);
    this.note.textContent = text;
    this.#noteTimer = setTimeout(() => (this.note.textContent = ""), NOTE_MS);
  }

  /** For screen readers only. */
  announce(text) {
    this.announcer.textContent = text;
  }

  /** Whether answers are saved, being saved or waiting; a quick saving is not worth a flicker. */
  setSaved(count, { failing, signedOut }) {
    clearTimeout(this.#savingTimer);
    if (failing) this.#setSaved("retrying", unsent(count, signedOut));
    else if (count) this.#savingTimer = setTimeout(() => this.#setSaved("saving", "Saving…"), SAVING_MS);
    else if (this.saved.dataset.state) this.#setSaved("saved", "Saved");
  }

  /** There is something that can be said to be saved. */
  beginSaving() {
    this.saved.dataset.state ||= "saving";
  }

  setUnreached(signedOut) {
    this.#setSaved("retrying", signedOut ? SIGNED_OUT : "Pebble does not answer; trying again.");
  }

  #setSaved(state, text) {
    this.saved.dataset.state = state;
    if (this.saved.textContent !== text) this.saved.textContent = text;
  }
}

const SIGNED_OUT = "Signed out: open the link with the token again. Your answers are kept here.";

/** Why there is no pair while the server is away, or wants the token again. */
export function unreachedSentence(count, signedOut) {
  if (signedOut) return `${SIGNED_OUT} This page then goes on.`;
  const kept = count === 1 ? "Your last answer is" : `Your last ${count} answers are`;
  return `Pebble does not answer.${count ? ` ${kept} kept here.` : ""} This page goes on when it is back.`;
}

function unsent(count, signedOut) {
  if (signedOut) return SIGNED_OUT;
  return count === 1 ? "1 answer not sent yet, retrying" : `${count} answers not sent yet, retrying`;
}
