// Problems of a form, each beside its field.

import { element, setText } from "../dom";

/**
 * Problems of the fields of a form. The message of a field is an element with its id and `-problem`,
 * created on demand.
 */
export class FieldProblems {
  private touched = new Set<Element>();

  constructor(private form: HTMLFormElement) {
    // Messages are beside the fields instead of over them.
    form.noValidate = true;
    form.addEventListener("change", (event) => {
      if (event.target instanceof Element) this.touched.add(event.target);
      this.showInvalid();
    });
  }

  set(field: HTMLElement, words: string | null): void {
    const id = `${field.id}-problem`;
    let problem = document.getElementById(id);
    if (problem === null) {
      if (words === null) return;
      problem = element("p", "problem field-problem");
      problem.id = id;
      (field.closest("label") ?? field).after(problem);
    }
    problem.hidden = words === null;
    setText(problem, words ?? "");
    if (words === null) {
      field.removeAttribute("aria-invalid");
      field.removeAttribute("aria-describedby");
    } else {
      field.setAttribute("aria-invalid", "true");
      field.setAttribute("aria-describedby", id);
    }
  }

  /** Shows problems of the fields that the user has left. */
  showInvalid(): void {
    for (const field of this.fields()) {
      this.set(field, this.touched.has(field) ? fieldProblem(field) : null);
    }
  }

  /** Shows problems of all fields, and focuses the first; returns true without problems. */
  check(): boolean {
    const fields = this.fields();
    fields.forEach((field) => this.touched.add(field));
    this.showInvalid();
    const first = fields.find((field) => fieldProblem(field) !== null);
    first?.focus();
    return first === undefined;
  }

  private fields(): HTMLInputElement[] {
    return [...this.form.querySelectorAll<HTMLInputElement>("input[id]")];
  }
}

export interface Field {
  value: string;
  disabled: boolean;
  min: string;
  max: string;
  title: string;
  validity: Partial<ValidityState>;
  validationMessage: string;
}

/** Problem of a field in words; null without one. */
export function fieldProblem(field: Field): string | null {
  const { validity } = field;
  if (field.disabled || validity.valid) return null;
  if (validity.badInput) return "This is not a number.";
  if (validity.valueMissing) return "This is needed.";
  if (validity.rangeUnderflow) return Number(field.min) < 0.01 ? "This must be greater than 0." : `This must be at least ${field.min}.`;
  if (validity.rangeOverflow) return `This must be at most ${field.max}.`;
  if (validity.stepMismatch) return "This must be a whole number.";
  if (validity.patternMismatch) return `This must have ${field.title}.`;
  return field.validationMessage;
}
