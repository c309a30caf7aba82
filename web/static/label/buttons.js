// Buttons for everything a key does, and the speed.

/** A button that was clicked gives the focus back, or Space would press it again instead of replaying. */
export function onClick(button, action) {
  button.addEventListener("click", (event) => {
    if (event.detail > 0) button.blur();
    action(event);
  });
}

/**
 * Full or half speed, remembered.
 * @param {HTMLButtonElement} button @param {import("./storage.js").Kept} kept @param {(rate: number) => void} play
 */
export function speedSwitch(button, kept, play) {
  const show = () => {
    play(kept.get());
    button.textContent = kept.get() === 1 ? "1×" : "½×";
    button.setAttribute("aria-label", `Speed ${button.textContent}`);
  };
  onClick(button, () => {
    kept.set(kept.get() === 1 ? 0.5 : 1);
    show();
  });
  show();
}
