// Drawing rate, adapted to the screen and processor.

/** Milliseconds between frames at full rate. */
const FRAME_MS = 1000 / 60;
/** Largest stretch of the times between drawings. */
const SLOWEST = 12;
const MEAN_OF = 10;

/**
 * Stretches the times between all drawings by one factor if frames are slower than sixty a second, so
 * that buttons and keys are answered.
 */
export class Pace {
  private frame_ms = FRAME_MS;
  private drawn = new Map<string, number>();

  /** Adds the time since the last frame. A pause of a second is a hidden page. */
  frame(elapsed_ms: number): void {
    if (elapsed_ms < 1000) this.frame_ms += (elapsed_ms - this.frame_ms) / MEAN_OF;
  }

  /** Returns true if a part with the period `every_ms` is due. */
  due(part: string, now_ms: number, every_ms: number): boolean {
    const stretch = Math.min(SLOWEST, Math.max(1, this.frame_ms / FRAME_MS));
    // A frame may be slightly early or late; without a stretch it is drawn anyway.
    const least_ms = stretch < 1.2 ? every_ms - FRAME_MS / 2 : every_ms * stretch;
    if (now_ms - (this.drawn.get(part) ?? -Infinity) < least_ms) return false;
    this.drawn.set(part, now_ms);
    return true;
  }

  all(): void {
    this.drawn.clear();
  }
}
