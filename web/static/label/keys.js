// One key per answer. Keys mean nothing while somebody types, in a dialog, or together with other modifiers.

const PRESSES = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "equal", ArrowDown: "skip" };

/**
 * @param {{canPress: () => boolean, press: (side: string, at: number) => void, undo: () => void, replay: () => void, help: () => void}} act
 */
export function listenToKeys(act) {
  document.addEventListener("keydown", (event) => {
    if (isHeldOnButton(event)) event.preventDefault();
    if (isElsewhere(event)) return;
    const action = actionOf(event, act);
    if (!action) return;
    event.preventDefault();
    if (!event.repeat) action();
  });
}

function actionOf(event, act) {
  const side = PRESSES[event.key];
  if (side) return act.canPress() ? () => act.press(side, event.timeStamp) : null;
  if (event.key.toLowerCase() === "z") return act.undo;
  if (event.key === "?") return act.help;
  if (event.key === " " && !event.target.closest("button, a, summary")) return act.replay;
  return null;
}

/** Enter held down would click a button again and again, and answer pairs that nobody has seen. */
function isHeldOnButton(event) {
  return event.repeat && event.key === "Enter" && event.target.closest?.("button");
}

function isElsewhere(event) {
  const modified = event.altKey || ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() !== "z");
  const typing = event.target.closest?.("input, textarea, select, [contenteditable], video");
  return event.defaultPrevented || event.isComposing || modified || typing || document.querySelector("dialog[open]");
}
