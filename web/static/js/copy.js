// Buttons that copy the text of a field, and leave it selected where the browser does not let them.
const SAID_FOR = 3000;

/** Browsers keep their clipboard from pages of other machines without TLS, but may still know the older command. */
const copied = async (text) => {
  const wrote = await navigator.clipboard?.writeText(text).then(
    () => true,
    () => false,
  );
  return wrote || document.execCommand("copy");
};

document.addEventListener("click", async (event) => {
  const button = event.target.closest("[data-copy]");
  if (!button) return;
  const field = document.querySelector(button.dataset.copy);
  field.focus();
  field.select();
  const done = await copied(field.value);
  if (done) button.focus();
  button.textContent = done ? "Copied" : "Copy it by hand";
  setTimeout(() => (button.textContent = "Copy"), SAID_FOR);
});
