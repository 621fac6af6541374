// Canvases with the pixels of the screen.

export interface Frame {
  ctx: CanvasRenderingContext2D;
  width: number;
  height: number;
}

/** Clears a canvas in CSS pixels; returns null while it has no size. */
export function begin(canvas: HTMLCanvasElement): Frame | null {
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const ctx = canvas.getContext("2d");
  if (ctx === null || width === 0 || height === 0) return null;
  const ratio = window.devicePixelRatio || 1;
  const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== w || canvas.height !== h) {
    canvas.width = w;
    canvas.height = h;
  }
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  ctx.clearRect(0, 0, width, height);
  return { ctx, width, height };
}

export function disc(ctx: CanvasRenderingContext2D, x: number, y: number, radius: number): void {
  ctx.beginPath();
  ctx.arc(x, y, radius, 0, 2 * Math.PI);
}

export function segment(ctx: CanvasRenderingContext2D, x0: number, y0: number, x1: number, y1: number): void {
  ctx.beginPath();
  ctx.moveTo(x0, y0);
  ctx.lineTo(x1, y1);
  ctx.stroke();
}

export function widest(ctx: CanvasRenderingContext2D, texts: readonly string[]): number {
  return Math.ceil(Math.max(0, ...texts.map((text) => ctx.measureText(text).width)));
}

/** Writes a text centred on a pixel, but within a canvas of this width. */
export function textWithin(ctx: CanvasRenderingContext2D, text: string, px: number, y: number, width: number): void {
  const half = ctx.measureText(text).width / 2 + 2;
  ctx.textAlign = "center";
  ctx.fillText(text, Math.min(Math.max(px, half), Math.max(half, width - half)), y);
}

/** Writes a text above a pixel, within the canvas, with a halo that covers what is behind it. */
export function labelAbove(ctx: CanvasRenderingContext2D, text: string, px: number, y: number, colour: string, halo: string): void {
  const half = ctx.measureText(text).width / 2 + 4;
  const [left, bottom] = [Math.min(Math.max(px, half), ctx.canvas.clientWidth - half), Math.max(y, 14)];
  ctx.textAlign = "center";
  ctx.textBaseline = "bottom";
  ctx.strokeStyle = halo;
  ctx.lineWidth = 5;
  ctx.lineJoin = "round";
  ctx.strokeText(text, left, bottom);
  ctx.fillStyle = colour;
  ctx.fillText(text, left, bottom);
}
