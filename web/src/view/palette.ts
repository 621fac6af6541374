// Colours of drawings on canvases.

const NAMES = ["ink", "quiet", "line", "card", "contact", "accent", "good", "warn", "bad", "sensor"] as const;

export type Palette = Record<(typeof NAMES)[number], string> & { font: string };

let known: Palette | null = null;
const listeners: (() => void)[] = [];

export function palette(): Palette {
  if (known === null) {
    const style = getComputedStyle(document.documentElement);
    const colours = NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]);
    known = { ...Object.fromEntries(colours), font: "12px system-ui, sans-serif" } as Palette;
  }
  return known;
}

export function onTheme(then: () => void): void {
  listeners.push(then);
}

export function themeChanged(): void {
  known = null;
  listeners.forEach((then) => then());
}

/**
 * Colour and dashes of a channel's line: the first sixteen differ, and within a group of four also
 * without colour.
 */
export function channelStroke(i: number): { stroke: string; dash: number[] } {
  const hue = [210, 25, 145, 285, 340, 180, 55, 250][i % 8]!;
  const dark = document.documentElement.dataset.theme === "dark";
  const dash = [[], [7, 3], [2, 3], [9, 3, 2, 3]][i % 4]!;
  return { stroke: `hsl(${hue} ${dark ? "75% 65%" : "75% 36%"})`, dash };
}
