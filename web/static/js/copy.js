// Buttons that copy the text of a field.
const SAID_FOR = 2000;
const KEYS = /Mac|iPhone|iPad/.test(navigator.platform) ? "\u2318C" : "Ctrl+C";

/** Browsers hide their clipboard from addresses that are neither https nor this machine, but know the older command. */
const copied = async (text) => {
  const wrote = await navigator.clipboard?.writeText(text).then(() => true, () => false);
  return wrote || document.execCommand("copy");
};

document.addEventListener("click", async (event) => {
  const button = event.target.closest("[data-copy]");
  if (!button) return;
  const field = document.querySelector(button.dataset.copy);
  field.select();
  button.textContent = (await copied(field.value)) ? "Copied" : `Selected: press ${KEYS}`;
  setTimeout(() => (button.textContent = "Copy"), SAID_FOR);
});
