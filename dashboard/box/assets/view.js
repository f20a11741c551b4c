// Where the floor is on the screen: metres to pixels and back, zoom, pan. y points up in the map, down on the screen.

export class View {
  constructor() {
    this.scale = 30; // px per m
    this.centre = [0, 0]; // m, map: what is in the middle
    this.width = this.height = 1; // px
    this.fitted = true; // the whole floor is shown, whatever its size
  }

  toScreen([x, y]) {
    return [this.width / 2 + (x - this.centre[0]) * this.scale, this.height / 2 - (y - this.centre[1]) * this.scale];
  }

  toMap([px, py]) {
    return [this.centre[0] + (px - this.width / 2) / this.scale, this.centre[1] - (py - this.height / 2) / this.scale];
  }

  /** Show a rectangle [m] whole. */
  fit([x0, y0, x1, y1], margin = 14) {
    this.fitted = true;
    this.centre = [(x0 + x1) / 2, (y0 + y1) / 2];
    const wide = (this.width - 2 * margin) / (x1 - x0), high = (this.height - 2 * margin) / (y1 - y0);
    this.scale = Math.max(0.5, Math.min(wide, high));
  }

  /** Zoom by a factor; the point under the pixel stays where it is. */
  zoom(factor, pixel = [this.width / 2, this.height / 2]) {
    const before = this.toMap(pixel);
    this.scale = Math.min(400, Math.max(0.5, this.scale * factor));
    const after = this.toMap(pixel);
    this.centre = [this.centre[0] + before[0] - after[0], this.centre[1] + before[1] - after[1]];
    this.fitted = false;
  }

  /** Move the picture by pixels. */
  pan(dx, dy) {
    this.centre = [this.centre[0] - dx / this.scale, this.centre[1] + dy / this.scale];
    this.fitted = false;
  }
}
