// The keys, in a dialog: the browser keeps the focus inside and lets Escape close it.

/** @param {HTMLDialogElement} dialog @param {Iterable<HTMLElement>} openers */
export function keysDialog(dialog, openers) {
  const open = () => dialog.open || dialog.showModal();
  for (const opener of openers) opener.addEventListener("click", open);
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  dialog.addEventListener("keydown", (event) => {
    if (event.key !== "?" || !dialog.open) return;
    event.preventDefault(); // or the page, which hears it next, would open the dialog again
    dialog.close();
  });
  return open;
}
