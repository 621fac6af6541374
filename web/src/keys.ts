// Single keys.

import { need, remember, remembered } from "./dom";

export function startKeys(actions: Record<string, () => void>): void {
  const on = need<HTMLInputElement>("keys-on");
  on.checked = remembered("keys") !== "off";
  on.addEventListener("change", () => remember("keys", on.checked ? "on" : "off"));
  document.addEventListener("keydown", (event) => {
    if (!on.checked || event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
    if (document.querySelector("dialog[open]") !== null || takesKey(event.target, event.key)) return;
    const action = actions[event.key === " " ? "space" : event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (action === undefined) return;
    event.preventDefault();
    action();
  });
}

/** Returns true for an element that uses the key itself. */
function takesKey(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target instanceof HTMLInputElement && target.type !== "range" && target.type !== "checkbox") return true;
  if (key === "Escape") return false;
  if (target instanceof HTMLSelectElement) return true;
  return key === " " && target.matches("button, input[type=checkbox], a, summary");
}
