// Theme: dark, light, or that of the system.

import { need, remember, remembered, setText } from "../dom";
import { themeChanged } from "./palette";

const CHOICES = ["system", "light", "dark"] as const;
type Choice = (typeof CHOICES)[number];

export function startTheme(): void {
  const button = need<HTMLButtonElement>("theme");
  const system = matchMedia("(prefers-color-scheme: dark)");
  const kept = remembered("theme") as Choice | null;
  let choice: Choice = kept !== null && CHOICES.includes(kept) ? kept : "system";
  const apply = () => {
    const dark = choice === "dark" || (choice === "system" && system.matches);
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    setText(button, `Theme: ${choice}`);
    button.setAttribute("aria-label", `Theme: ${choice === "system" ? "as the system" : choice}. Change it`);
    themeChanged();
  };
  button.addEventListener("click", () => {
    choice = CHOICES[(CHOICES.indexOf(choice) + 1) % CHOICES.length]!;
    remember("theme", choice);
    apply();
  });
  system.addEventListener("change", apply);
  apply();
}
