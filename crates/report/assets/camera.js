// One look at the scene: parallel projection, so that it is to scale everywhere.
pkm.dot = (u, v) => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
pkm.cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];

pkm.Camera = class {
  // `view` as the data has it: name, space (can be turned), right and up on the screen.
  constructor(view, bit) {
    this.view = view;
    this.bit = bit;
    this.home = { right: view.right, up: view.up, towards: pkm.cross(view.right, view.up) };
    this.rect = { x: 0, y: 0, width: 1, height: 1 };
    this.centre = [0, 0, 0];
    this.scale = 1;
    this.fitted = false;
    this.look(view.space ? -0.6 : 0, view.space ? 0.42 : 0);
  }

  // Turns about the scene's up by `yaw`, then rises by `pitch` (radians; 0, 0 is the front).
  look(yaw, pitch) {
    const { right, up, towards } = this.home;
    this.yaw = yaw;
    this.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, pitch));
    const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const level = right.map((_, i) => sy * right[i] + cy * towards[i]);
    this.right = right.map((_, i) => cy * right[i] - sy * towards[i]);
    this.up = up.map((_, i) => cp * up[i] - sp * level[i]);
    this.towards = up.map((_, i) => cp * level[i] + sp * up[i]);
  }

  // Scene (mm) to the screen (CSS pixels).
  project(p) {
    const d = [p[0] - this.centre[0], p[1] - this.centre[1], p[2] - this.centre[2]];
    return [
      this.rect.x + this.rect.width / 2 + this.scale * pkm.dot(this.right, d),
      this.rect.y + this.rect.height / 2 - this.scale * pkm.dot(this.up, d),
    ];
  }

  depth(p) {
    return pkm.dot(this.towards, p);
  }

  // The projection of points given in a frame, as numbers: [xx xy xz x0, yx yy yz y0].
  matrix(frame) {
    const [x0, y0] = this.project(frame.origin);
    const along = (axis) => [this.scale * pkm.dot(this.right, axis), -this.scale * pkm.dot(this.up, axis)];
    const [x, y, z] = frame.axes.map(along);
    return [x[0], y[0], z[0], x0, x[1], y[1], z[1], y0];
  }

  // Shows all these points.
  fit(points) {
    let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
    let [near, far] = [-Infinity, Infinity];
    for (const p of points) {
      const [a, b, c] = [pkm.dot(this.right, p), pkm.dot(this.up, p), pkm.dot(this.towards, p)];
      if (!Number.isFinite(a + b + c)) continue;
      [left, right, low, high] = [Math.min(left, a), Math.max(right, a), Math.min(low, b), Math.max(high, b)];
      [near, far] = [Math.max(near, c), Math.min(far, c)];
    }
    if (!(left <= right)) [left, right, low, high, near, far] = [-100, 100, -100, 100, 0, 0];
    const middle = [(left + right) / 2, (low + high) / 2, (near + far) / 2];
    this.centre = [0, 1, 2].map((i) => this.right[i] * middle[0] + this.up[i] * middle[1] + this.towards[i] * middle[2]);
    const margin = Math.min(46, 0.12 * Math.min(this.rect.width, this.rect.height));
    this.scale = Math.min(
      Math.max(40, this.rect.width - 2 * margin) / Math.max(1e-6, right - left),
      Math.max(40, this.rect.height - 2 * margin) / Math.max(1e-6, high - low),
    );
    this.fitted = true;
  }

  // Moves by pixels.
  pan(dx, dy) {
    this.centre = this.centre.map((c, i) => c - (dx * this.right[i] - dy * this.up[i]) / this.scale);
    this.fitted = false;
  }

  // Nearer (factor above 1) with the point under the pointer in place.
  zoom(factor, x, y) {
    const off = [x - this.rect.x - this.rect.width / 2, y - this.rect.y - this.rect.height / 2];
    const scale = Math.max(1e-4, Math.min(1e5, this.scale * factor));
    const k = 1 / this.scale - 1 / scale;
    this.centre = this.centre.map((c, i) => c + k * (off[0] * this.right[i] - off[1] * this.up[i]));
    this.scale = scale;
    this.fitted = false;
  }

  contains(x, y) {
    const r = this.rect;
    return x >= r.x && x < r.x + r.width && y >= r.y && y < r.y + r.height;
  }
};
