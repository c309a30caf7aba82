// Motion only where it means something, and none for people who asked for none.

const reduced = matchMedia("(prefers-reduced-motion: reduce)");

export const motionIsWelcome = () => !reduced.matches;

/** The chosen clip nods; both do for an equal pair, and none when the labeller could not tell. */
export function nod(clips, pressed) {
  if (!motionIsWelcome()) return;
  for (const clip of clips) {
    if (pressed === "equal" || clip.dataset.press === pressed) clip.animate(NOD, { duration: 320, easing: "ease-out" });
  }
}

const NOD = [
  { transform: "none", outlineColor: "var(--accent)", offset: 0 },
  { transform: "translateY(0.5rem)", outlineColor: "var(--accent)", offset: 0.3 },
  { transform: "none", outlineColor: "var(--accent)", offset: 0.6 },
  { transform: "none", outlineColor: "transparent", offset: 1 },
];
