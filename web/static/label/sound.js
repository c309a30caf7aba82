// A soft beep when pairs arrive, made here, for those who switched it on.

/** @param {HTMLButtonElement} button @param {import("./storage.js").Kept} kept */
export function arrivalSound(button, kept) {
  let context = null;
  const show = () => {
    button.textContent = kept.get() ? "Sound on" : "Sound off";
  };
  const play = () => {
    if (!kept.get()) return;
    context ??= new AudioContext();
    context.resume().then(() => beep(context)).catch(() => {});
  };
  button.addEventListener("click", () => {
    kept.set(!kept.get());
    show();
    play();
  });
  show();
  return play;
}

function beep(context) {
  const [tone, volume, now] = [context.createOscillator(), context.createGain(), context.currentTime];
  tone.frequency.setValueAtTime(660, now);
  tone.frequency.setValueAtTime(880, now + 0.09);
  volume.gain.setValueAtTime(0, now);
  volume.gain.linearRampToValueAtTime(0.12, now + 0.02);
  volume.gain.exponentialRampToValueAtTime(0.001, now + 0.35);
  tone.connect(volume).connect(context.destination);
  tone.start(now);
  tone.stop(now + 0.4);
}
