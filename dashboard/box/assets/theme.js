// The colours of the page, light or dark, as the style sheet has them.

export let theme = {};

/** Read the colours of the theme, which the style sheet has. */
export function readTheme() {
  const style = getComputedStyle(document.documentElement);
  const names = ["ink", "soft", "floor", "wall", "obstacle", "unknown", "grid", "target", "start", "wait", "bad", "good", "halo"];
  theme = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}
