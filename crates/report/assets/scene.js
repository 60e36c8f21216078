// The machine, its paths and the workspace, to scale. Two layers: the back one (grid, workspace, paths) is drawn again
// only when it changes; the front one (the machine) with every frame.
pkm.scene = (() => {
  const { data, colours } = pkm;
  const { drawing, rows } = data;
  const stage = document.getElementById('stage');
  const back = document.getElementById('back');
  const front = document.getElementById('front-layer');
  const cameras = drawing.views.map((view, n) => new pkm.Camera(view, 1 << n));
  const show = { programmed: true, executed: true, workspace: true, exaggerate: 1 };
  const points = new Float64Array(data.width.points);
  let ratio = 1;
  let stale = true;
  let backKey = '';
  let tick = 0;
  let shownLine = 0;

  // A point of the drawing: moving ones from 0, fixed ones from −1 downwards.
  const point = (n, list = points, offset = 0) =>
    n < 0 ? drawing.fixed[-1 - n] : [list[offset + 3 * n], list[offset + 3 * n + 1], list[offset + 3 * n + 2]];

  const IDENTITY = { origin: [0, 0, 0], axes: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] };
  const AXIS_MM = 100;

  // The frame of a path now: origin (with the path's constant part) and axes in the scene.
  function frameOf(path, list = points, offset = 0) {
    let { origin, axes } = IDENTITY;
    if (path.frame.length > 0) origin = point(path.frame[0], list, offset);
    if (path.frame.length === 4) {
      axes = path.frame.slice(1).map((n) => point(n, list, offset).map((v, i) => (v - origin[i]) / AXIS_MM));
    }
    const at = origin.map((v, i) => v + path.offset[0] * axes[0][i] + path.offset[1] * axes[1][i] + path.offset[2] * axes[2][i]);
    return { origin: at, axes };
  }

  // Where the letters of a path stand among the machine's axes; −1: constant 0.
  const columns = drawing.paths.map((path) =>
    path.letters.map((letter) => (letter < 0 ? -1 : data.axes.findIndex((axis) => axis.place === letter))));

  function inScene(path, frame, pose, column) {
    const v = column.map((c) => (c < 0 ? 0 : pose[c]));
    return frame.origin.map((o, i) => o + v[0] * frame.axes[0][i] + v[1] * frame.axes[1][i] + v[2] * frame.axes[2][i]);
  }

  // Points that must be on the screen of a view: the machine and its paths over the whole run, or the paths alone.
  function extent(camera, paths = false) {
    const all = [];
    const seen = (item) => (item.views & camera.bit) !== 0;
    const step = Math.max(1, Math.floor(rows.count / 200));
    for (const part of paths ? [] : drawing.parts.filter(seen)) {
      for (const n of part.points) {
        if (n < 0) all.push(drawing.fixed[-1 - n]);
        else for (let row = 0; row < rows.count; row += step) all.push(point(n, rows.points, row * data.width.points));
      }
    }
    drawing.paths.forEach((path, n) => {
      if (!seen(path)) return;
      const frame = frameOf(path);
      const { count, pose } = data.corners;
      const stride = data.width.pose;
      for (let i = 0; i < count; i += Math.max(1, Math.floor(count / 500))) {
        all.push(inScene(path, frame, pose.subarray(i * stride, (i + 1) * stride), columns[n]));
      }
    });
    for (const space of paths ? [] : data.workspaces) {
      if ((space.views & camera.bit) !== 0) for (const loop of space.loops) all.push(...loop);
    }
    return all;
  }

  // Divides the stage among the views: the ones in space get the larger part.
  function layOut() {
    const { clientWidth: width, clientHeight: height } = stage;
    ratio = Math.min(3, window.devicePixelRatio || 1);
    for (const canvas of [back, front]) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const flat = cameras.filter((camera) => !camera.view.space);
    const space = cameras.filter((camera) => camera.view.space);
    const place = (list, x, y, w, h, across) => list.forEach((camera, n) => {
      camera.rect = across
        ? { x: x + (n * w) / list.length, y, width: w / list.length, height: h }
        : { x, y: y + (n * h) / list.length, width: w, height: h / list.length };
    });
    if (flat.length === 0 || space.length === 0) {
      place(cameras, 0, 0, width, height, width > height);
    } else if (width > 560) {
      const left = flat.length > 1 ? 0.42 : 0.48;
      place(flat, 0, 0, width * left, height, false);
      place(space, width * left, 0, width * (1 - left), height, false);
    } else {
      place(flat, 0, 0, width, height * 0.45, true);
      place(space, 0, height * 0.45, width, height * 0.55, true);
    }
    for (const camera of cameras) if (camera.fitted || !camera.placed) camera.fit(extent(camera));
    for (const camera of cameras) camera.placed = true;
    stale = true;
  }

  function clip(context, camera) {
    const { x, y, width, height } = camera.rect;
    context.beginPath();
    context.rect(x, y, width, height);
    context.clip();
  }

  // A round number of mm that takes at least `pixels`.
  function roundStep(scale, pixels) {
    const least = pixels / scale;
    const power = 10 ** Math.floor(Math.log10(least));
    return [1, 2, 5, 10].map((k) => k * power).find((step) => step >= least);
  }

  const format = (value, step) => value.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9))).replace('-', '−');

  // Grid in mm of a flat view; a scale and the axes of one in space.
  function grid(context, camera) {
    const { x, y, width, height } = camera.rect;
    const step = roundStep(camera.scale, 60);
    context.font = '11px system-ui, sans-serif';
    context.lineWidth = 1;
    if (!camera.view.space) {
      const [a, b] = [pkm.dot(camera.right, camera.centre), pkm.dot(camera.up, camera.centre)];
      const lines = (middle, size) => {
        const out = [];
        const half = size / 2 / camera.scale;
        for (let k = Math.ceil((middle - half) / step); k * step <= middle + half; k += 1) out.push(k * step);
        return out;
      };
      context.strokeStyle = colours.grid;
      context.beginPath();
      for (const v of lines(a, width)) {
        const at = Math.round(x + width / 2 + (v - a) * camera.scale) + 0.5;
        context.moveTo(at, y);
        context.lineTo(at, y + height);
      }
      for (const v of lines(b, height)) {
        const at = Math.round(y + height / 2 - (v - b) * camera.scale) + 0.5;
        context.moveTo(x, at);
        context.lineTo(x + width, at);
      }
      context.stroke();
      context.fillStyle = colours.soft;
      context.textAlign = 'center';
      for (const v of lines(a, width)) {
        const at = x + width / 2 + (v - a) * camera.scale;
        if (at > x + 34 && at < x + width - 30) context.fillText(format(v, step), at, y + height - 5);
      }
      context.textAlign = 'left';
      for (const v of lines(b, height)) {
        const at = y + height / 2 - (v - b) * camera.scale;
        if (at > y + 26 && at < y + height - 20) context.fillText(format(v, step), x + 4, at + 4);
      }
      const name = (direction) => drawing.axes[direction.findIndex((v) => Math.abs(v) > 0.5)];
      context.fillStyle = colours.ink;
      context.textAlign = 'right';
      context.fillText(`${name(camera.right)} mm →`, x + width - 6, y + height - 18);
      context.textAlign = 'left';
      context.fillText(`↑ ${name(camera.up)} mm`, x + 4, y + 30);
    } else {
      const length = step * camera.scale;
      const [sx, sy] = [x + width - 16 - length, y + height - 14];
      context.strokeStyle = colours.ink;
      context.beginPath();
      context.moveTo(sx, sy - 4);
      context.lineTo(sx, sy);
      context.lineTo(sx + length, sy);
      context.lineTo(sx + length, sy - 4);
      context.stroke();
      context.fillStyle = colours.ink;
      context.textAlign = 'center';
      context.fillText(`${format(step, step)} mm`, sx + length / 2, sy - 5);
      const origin = [x + 34, y + height - 34];
      IDENTITY.axes.forEach((axis, n) => {
        const d = [pkm.dot(camera.right, axis) * 24, -pkm.dot(camera.up, axis) * 24];
        context.beginPath();
        context.moveTo(...origin);
        context.lineTo(origin[0] + d[0], origin[1] + d[1]);
        context.stroke();
        if (Math.hypot(...d) > 8) context.fillText(drawing.axes[n], origin[0] + d[0] * 1.35, origin[1] + d[1] * 1.35 + 4);
      });
    }
    if (cameras.length > 1) {
      context.textAlign = 'left';
      context.fillStyle = colours.ink;
      context.font = '600 12px system-ui, sans-serif';
      context.fillText(camera.view.name, x + 8, y + 16);
      context.strokeStyle = colours.line;
      context.strokeRect(x + 0.5, y + 0.5, width, height);
    }
  }

  function workspaces(context, camera) {
    for (const space of data.workspaces) {
      if ((space.views & camera.bit) === 0) continue;
      context.beginPath();
      for (const loop of space.loops) {
        loop.forEach((p, n) => (n === 0 ? context.moveTo(...camera.project(p)) : context.lineTo(...camera.project(p))));
        context.closePath();
      }
      context.fillStyle = colours.space;
      if (space.filled) context.fill('evenodd');
      context.strokeStyle = colours['space-edge'];
      context.lineWidth = 1;
      context.setLineDash([5, 3]);
      context.stroke();
      context.setLineDash([]);
      if (data.workspaces.length > 1 && !space.name.includes(',') && space.loops[0]) {
        // Its name: below it, or above it if only its edge is drawn.
        const side = space.filled ? 1 : -1;
        const [x, y] = space.loops[0].map((p) => camera.project(p)).reduce((a, b) => (side * (b[1] - a[1]) > 0 ? b : a));
        context.fillStyle = colours.soft;
        context.font = '11px system-ui, sans-serif';
        context.textAlign = 'center';
        context.fillText(space.name, x, y + (space.filled ? 14 : -7));
      }
    }
  }

  // The projection of a path's points: from the values of its letters to the screen.
  function projector(camera, path) {
    const m = camera.matrix(frameOf(path));
    return (a, b, c) => [m[0] * a + m[1] * b + m[2] * c + m[3], m[4] * a + m[5] * b + m[6] * c + m[7]];
  }

  function programmedPath(context, camera, path, column) {
    const to = projector(camera, path);
    const { count, pose, flags } = data.corners;
    const stride = data.width.pose;
    const v = (row, n) => (column[n] < 0 ? 0 : pose[row * stride + column[n]]);
    for (const rapid of [true, false]) {
      context.beginPath();
      for (let i = 1; i < count; i += 1) {
        if ((flags[i] & 1) !== 0 || ((flags[i] & 2) !== 0) !== rapid) continue;
        context.moveTo(...to(v(i - 1, 0), v(i - 1, 1), v(i - 1, 2)));
        context.lineTo(...to(v(i, 0), v(i, 1), v(i, 2)));
      }
      context.strokeStyle = colours.programmed;
      context.lineWidth = rapid ? 1 : 4;
      context.globalAlpha = rapid ? 1 : 0.4;
      context.setLineDash(rapid ? [2, 4] : []);
      context.stroke();
    }
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  // A coordinate of the executed path at a kept row: where the step edges put the machine, pulled away from the
  // programmed path by the factor; where that is not known, the commanded one.
  function executed(row, c) {
    const stride = data.width.pose;
    const commanded = rows.pose[row * stride + c];
    const off = rows.executed[2 * row * stride + c];
    const near = rows.executed[2 * row * stride + stride + c];
    return Number.isNaN(off) ? commanded : commanded + near + show.exaggerate * (off - near);
  }

  function executedPath(context, camera, path, column) {
    if (!data.timed) return;
    const to = projector(camera, path);
    const v = (row, n) => (column[n] < 0 ? 0 : executed(row, column[n]));
    context.lineWidth = 1.6;
    context.lineJoin = 'round';
    let open = -1;
    const { kinds, ofCode } = pkm.limits;
    const finish = () => {
      if (open >= 0 && kinds[open].shown) {
        context.strokeStyle = colours[kinds[open].colour];
        context.stroke();
      }
    };
    for (let i = 1; i < rows.count; i += 1) {
      const kind = ofCode(rows.limit[i]);
      if (rows.jump[i] === 1) {
        finish();
        open = -1;
        continue;
      }
      if (kind !== open) {
        finish();
        context.beginPath();
        context.moveTo(...to(v(i - 1, 0), v(i - 1, 1), v(i - 1, 2)));
        open = kind;
      }
      context.lineTo(...to(v(i, 0), v(i, 1), v(i, 2)));
    }
    finish();
  }

  // The places that the machine cannot be at, and how far the tool is from that of the line it is at.
  function refused(context, camera, path, column) {
    const to = projector(camera, path);
    const v = data.values('pose', tick);
    const tip = to(...column.map((c) => (c < 0 ? 0 : v[c])));
    for (const place of data.refused) {
      const [x, y] = to(...column.map((c) => (c < 0 ? 0 : place.pose[c])));
      if (place.line === shownLine) {
        context.strokeStyle = colours.finding;
        context.lineWidth = 1.5;
        context.setLineDash([4, 3]);
        context.beginPath();
        context.moveTo(...tip);
        context.lineTo(x, y);
        context.stroke();
        context.setLineDash([]);
      }
      context.strokeStyle = colours.finding;
      context.fillStyle = colours.finding;
      context.lineWidth = 2;
      context.beginPath();
      context.moveTo(x - 6, y - 6);
      context.lineTo(x + 6, y + 6);
      context.moveTo(x - 6, y + 6);
      context.lineTo(x + 6, y - 6);
      context.stroke();
      context.font = '12px system-ui, sans-serif';
      context.textAlign = 'left';
      context.fillText(`line ${place.line}`, x + 9, y + 4);
    }
  }

  function drawBack() {
    const context = back.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, stage.clientWidth, stage.clientHeight);
    for (const camera of cameras) {
      context.save();
      clip(context, camera);
      if (!camera.view.space && show.workspace) workspaces(context, camera);
      grid(context, camera);
      if (camera.view.space && show.workspace) workspaces(context, camera);
      drawing.paths.forEach((path, n) => {
        if ((path.views & camera.bit) === 0) return;
        if (show.programmed) programmedPath(context, camera, path, columns[n]);
        if (show.executed) executedPath(context, camera, path, columns[n]);
        refused(context, camera, path, columns[n]);
      });
      if (show.exaggerate > 1) {
        context.fillStyle = colours.ink;
        context.font = '600 12px system-ui, sans-serif';
        context.textAlign = 'right';
        context.fillText(`deviation × ${show.exaggerate}`, camera.rect.x + camera.rect.width - 8, camera.rect.y + 16);
      }
      context.restore();
    }
  }

  // One part of the machine on the screen.
  function drawPart(context, camera, part) {
    const p = part.points.map((n) => camera.project(point(n)));
    const colour = part.of !== null && part.kind !== 'tip' ? colours['j' + part.of] : colours.body;
    const line = (width, stroke, from = p[0], to = p[1]) => {
      context.beginPath();
      context.moveTo(...from);
      context.lineTo(...to);
      context.lineWidth = width;
      context.strokeStyle = stroke;
      context.stroke();
    };
    const outline = (width, fill) => {
      context.beginPath();
      p.forEach((q, n) => (n === 0 ? context.moveTo(...q) : context.lineTo(...q)));
      context.closePath();
      if (fill) {
        context.fillStyle = colours['body-fill'];
        context.fill();
      }
      context.lineWidth = width;
      context.strokeStyle = colours.body;
      context.stroke();
    };
    context.lineCap = 'round';
    context.setLineDash([]);
    switch (part.kind) {
      case 'rail': {
        line(2, colour);
        context.lineCap = 'butt';
        const d = [p[1][0] - p[0][0], p[1][1] - p[0][1]];
        const length = Math.hypot(...d);
        if (length > 1) {
          const across = [(-d[1] / length) * 6, (d[0] / length) * 6];
          for (const q of p) line(2, colour, [q[0] - across[0], q[1] - across[1]], [q[0] + across[0], q[1] + across[1]]);
        }
        break;
      }
      case 'slider': {
        const d = [p[2][0] - p[1][0], p[2][1] - p[1][1]];
        const length = Math.hypot(...d) || 1;
        const half = Math.min(11, Math.max(5, length / 18));
        const unit = [(d[0] / length) * half, (d[1] / length) * half];
        const past = outside(part);
        context.lineCap = 'butt';
        line(14, past ? colours.finding : colour, [p[0][0] - unit[0], p[0][1] - unit[1]], [p[0][0] + unit[0], p[0][1] + unit[1]]);
        if (part.name) {
          // Outwards of the machine's middle.
          const outwards = p[0][0] < camera.rect.x + camera.rect.width / 2 ? -1 : 1;
          context.fillStyle = past ? colours.finding : colour;
          context.font = '600 12px system-ui, sans-serif';
          const level = Math.abs(d[0]) > 2 * Math.abs(d[1]);
          context.textAlign = level ? 'center' : outwards < 0 ? 'right' : 'left';
          const [x, y] = level ? [p[0][0], p[0][1] + 22] : [p[0][0] + 12 * outwards, p[0][1] + 4];
          context.fillText(past ? `${part.name} past its end` : part.name, x, y);
        }
        break;
      }
      case 'link':
        line(3.5, colours.body);
        break;
      case 'strut': {
        const middle = [(p[0][0] + p[1][0]) / 2, (p[0][1] + p[1][1]) / 2];
        line(7, colour, p[0], middle);
        line(3, colours.body, middle, p[1]);
        break;
      }
      case 'wire':
        line(2, colours.wire);
        break;
      case 'tool':
        line(5, colours.body);
        break;
      case 'platform':
        outline(3, p.length > 2);
        break;
      case 'body':
        outline(1.2, true);
        break;
      case 'disc': {
        // Centre and two radii a quarter apart.
        context.beginPath();
        for (let k = 0; k <= 48; k += 1) {
          const [c, s] = [Math.cos((k * Math.PI) / 24), Math.sin((k * Math.PI) / 24)];
          const q = [0, 1].map((i) => p[0][i] + c * (p[1][i] - p[0][i]) + s * (p[2][i] - p[0][i]));
          if (k === 0) context.moveTo(...q); else context.lineTo(...q);
        }
        context.fillStyle = colours['body-fill'];
        context.fill();
        context.lineWidth = 2;
        context.strokeStyle = colour;
        context.stroke();
        line(1.5, colour);
        break;
      }
      case 'hinge':
        for (const q of p) {
          context.beginPath();
          context.arc(q[0], q[1], 3.2, 0, 2 * Math.PI);
          context.fillStyle = colours.paper;
          context.fill();
          context.lineWidth = 1.6;
          context.strokeStyle = colours.body;
          context.stroke();
        }
        break;
      default: // tip
        context.beginPath();
        context.arc(p[0][0], p[0][1], 5, 0, 2 * Math.PI);
        context.fillStyle = colours.tip;
        context.fill();
        context.beginPath();
        context.arc(p[0][0], p[0][1], 9, 0, 2 * Math.PI);
        context.lineWidth = 1.5;
        context.strokeStyle = colours.tip;
        context.stroke();
    }
  }

  // A slider that stands beyond an end of its travel (drawn for programs that were refused).
  function outside(part) {
    const joint = data.joints[part.of];
    if (data.timed || !joint?.range) return false;
    const value = data.values('joints', tick)[part.of];
    return value < joint.range[0] - 1e-6 || value > joint.range[1] + 1e-6;
  }

  const ORDER = { rail: 0, body: 0, disc: 0, link: 1, strut: 1, slider: 2, platform: 2, wire: 3, tool: 3, hinge: 4, tip: 5 };

  function drawFront() {
    const context = front.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, stage.clientWidth, stage.clientHeight);
    for (const camera of cameras) {
      context.save();
      clip(context, camera);
      const parts = drawing.parts.filter((part) => (part.views & camera.bit) !== 0).map((part) => {
        const depths = part.points.map((n) => camera.depth(point(n)));
        return { part, depth: depths.reduce((sum, d) => sum + d, 0) / depths.length };
      });
      parts.sort((a, b) => ((a.part.kind === 'tip') - (b.part.kind === 'tip'))
        || (camera.view.space ? a.depth - b.depth : 0) || ORDER[a.part.kind] - ORDER[b.part.kind]);
      for (const { part } of parts) drawPart(context, camera, part);
      context.restore();
    }
  }

  // Draws the machine at a time; the paths too, where they or the view have moved.
  function draw(now, line = 0) {
    tick = now;
    if (!data.timed) stale = true;
    shownLine = line;
    data.values('points', tick, points);
    const key = drawing.paths.map((path) => path.frame.map((n) => point(n).join()).join()).join();
    if (stale || key !== backKey) drawBack();
    stale = false;
    backKey = key;
    drawFront();
  }

  // The kept row whose place on the screen is nearest to a pointer, within 12 pixels.
  function nearestRow(x, y) {
    const camera = cameras.find((c) => c.contains(x, y));
    let best = { row: -1, distance: 12 };
    if (!camera) return -1;
    drawing.paths.forEach((path, n) => {
      if ((path.views & camera.bit) === 0) return;
      const to = projector(camera, path);
      const v = (row, k) => (columns[n][k] < 0 ? 0 : executed(row, columns[n][k]));
      for (let row = 0; row < rows.count; row += 1) {
        const [px, py] = to(v(row, 0), v(row, 1), v(row, 2));
        const distance = Math.hypot(px - x, py - y);
        if (distance < best.distance) best = { row, distance };
      }
    });
    return best.row;
  }

  // Where a pose of the run is on the screen, path by path: what the browser test compares.
  function projected(pose) {
    return drawing.paths.map((path, n) => cameras.filter((c) => (path.views & c.bit) !== 0)
      .map((camera) => camera.project(inScene(path, frameOf(path), pose, columns[n]))));
  }

  return {
    cameras, show, draw, layOut, nearestRow, projected, front, stage,
    refresh() { stale = true; },
    fit(camera, paths = false) { camera.fit(extent(camera, paths)); camera.fitted = !paths; stale = true; },
  };
})();
