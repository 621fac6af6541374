// How often a page draws, on screens and processors that it does not know.

/** Milliseconds between the frames of a screen that keeps up. */
const FRAME_MS = 1000 / 60;
/** Longest stretch of the times between drawings. */
const SLOWEST = 12;
/** Frames over which the mean is taken, about. */
const MEAN_OF = 10;

/**
 * Paces drawings by the time that frames take: where the browser does not keep up with sixty a second, everything is drawn less often by the
 * same factor, so that buttons and keys are answered.
 */
export class Pace {
  private frame_ms = FRAME_MS;
  private drawn = new Map<string, number>();

  /** Takes the time since the last frame. A pause of a second is a page that was hidden. */
  frame(elapsed_ms: number): void {
    if (elapsed_ms < 1000) this.frame_ms += (elapsed_ms - this.frame_ms) / MEAN_OF;
  }

  /** True when a part is to be drawn, that is drawn every so many milliseconds where the browser keeps up. */
  due(part: string, now_ms: number, every_ms: number): boolean {
    const stretch = Math.min(SLOWEST, Math.max(1, this.frame_ms / FRAME_MS));
    // A frame comes a little before or after its time; one that is not stretched is taken as it comes.
    const least_ms = stretch < 1.2 ? every_ms - FRAME_MS / 2 : every_ms * stretch;
    if (now_ms - (this.drawn.get(part) ?? -Infinity) < least_ms) return false;
    this.drawn.set(part, now_ms);
    return true;
  }

  /** Makes everything due. */
  all(): void {
    this.drawn.clear();
  }
}
