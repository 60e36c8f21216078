// Ties time, scene, curves and program together: pointer, keys, buttons, size, colours.
(() => {
  const { data, scene, curves, listing, player, limits, colours } = pkm;
  const byId = (id) => document.getElementById(id);
  const hint = byId('hint');

  let line = -1;
  // The line whose finding is looked at.
  let chosen = 0;
  function redraw() {
    scene.draw(player.tick, chosen);
    curves.draw(player.tick);
    curves.readout(player.tick);
  }
  player.onShown((tick, at) => {
    if (at !== line) listing.set(at);
    line = at;
    redraw();
  });
  function goToLine(to) {
    chosen = to;
    player.play(false);
    player.toLine(to);
    listing.choose(to);
  }
  listing.onGo(goToLine);
  function go(tick) {
    player.play(false);
    player.set(tick);
    player.snap();
  }

  // Buttons of colours: what limits, and the joints.
  function key(parent, name, colour, pressed) {
    const button = document.createElement('button');
    button.className = 'key';
    button.setAttribute('aria-pressed', 'true');
    const swatch = document.createElement('i');
    swatch.style.color = `var(--${colour})`;
    button.append(swatch, name);
    button.addEventListener('click', () => button.setAttribute('aria-pressed', pressed() ? 'true' : 'false'));
    parent.append(button);
    return button;
  }
  if (data.timed) {
    const used = new Set(data.rows.limit.map((code) => limits.ofCode(code)));
    byId('legend').append('limited by');
    limits.kinds.forEach((kind, n) => {
      if (!used.has(n)) return;
      key(byId('legend'), kind.name, kind.colour, () => {
        kind.shown = !kind.shown;
        scene.refresh();
        redraw();
        return kind.shown;
      });
    });
  } else {
    byId('curves').querySelector('canvas').hidden = true;
    byId('exaggerate').parentElement.hidden = true;
    byId('show-executed').parentElement.hidden = true;
  }
  const jointButtons = data.joints.map((joint, j) => key(byId('joint-buttons'), `${j + 1} ${joint.name}`, `j${j}`, () => {
    curves.shown[j] = !curves.shown[j];
    curves.refresh();
    redraw();
    return curves.shown[j];
  }));

  for (const name of ['programmed', 'executed', 'workspace']) {
    byId(`show-${name}`).addEventListener('change', (event) => {
      scene.show[name] = event.target.checked;
      scene.refresh();
      redraw();
    });
  }
  byId('workspace-label').hidden = data.workspaces.length === 0;
  byId('exaggerate').addEventListener('change', (event) => {
    scene.show.exaggerate = Number(event.target.value);
    scene.refresh();
    redraw();
  });

  const inSpace = scene.cameras.filter((camera) => camera.view.space);
  function look(yaw, pitch) {
    for (const camera of inSpace) {
      camera.look(yaw, pitch);
      scene.fit(camera);
    }
    redraw();
  }
  const fit = (paths) => { scene.cameras.forEach((camera) => scene.fit(camera, paths)); redraw(); };
  const looks = { fit: () => fit(false), 'fit-path': () => fit(true), front: () => look(0, 0), side: () => look(Math.PI / 2, 0), top: () => look(0, Math.PI / 2) };
  for (const [id, action] of Object.entries(looks)) byId(id).addEventListener('click', action);
  for (const id of ['front', 'side', 'top']) byId(id).hidden = inSpace.length === 0;

  // Pointers on the scene: one turns or moves, two move and zoom, a click goes to the path.
  const pointers = new Map();
  let moved = 0;
  const local = (event) => {
    const box = scene.front.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const cameraAt = (x, y) => scene.cameras.find((camera) => camera.contains(x, y)) ?? scene.cameras[0];
  scene.front.addEventListener('pointerdown', (event) => {
    const [x, y] = local(event);
    pointers.set(event.pointerId, { x, y, camera: cameraAt(x, y) });
    scene.front.setPointerCapture(event.pointerId);
    moved = 0;
  });
  scene.front.addEventListener('pointermove', (event) => {
    const [x, y] = local(event);
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return hover(x, y);
    const [dx, dy] = [x - pointer.x, y - pointer.y];
    moved += Math.abs(dx) + Math.abs(dy);
    const { camera } = pointer;
    const other = [...pointers.entries()].find(([id]) => id !== event.pointerId)?.[1];
    if (other) {
      const apart = (px, py) => Math.max(20, Math.hypot(px - other.x, py - other.y));
      camera.pan(dx / 2, dy / 2);
      camera.zoom(apart(x, y) / apart(pointer.x, pointer.y), (x + other.x) / 2, (y + other.y) / 2);
    } else if (camera.view.space && !event.shiftKey && event.buttons !== 2) {
      camera.look(camera.yaw - dx * 0.008, camera.pitch + dy * 0.008);
    } else camera.pan(dx, dy);
    [pointer.x, pointer.y] = [x, y];
    scene.refresh();
    redraw();
  });
  const release = (event) => {
    const [x, y] = local(event);
    if (pointers.delete(event.pointerId) && event.type === 'pointerup' && moved < 4) {
      const row = scene.nearestRow(x, y);
      if (row >= 0) go(data.rows.ticks[row]);
    }
  };
  scene.front.addEventListener('pointerup', release);
  scene.front.addEventListener('pointercancel', release);
  scene.front.addEventListener('pointerleave', () => { hint.style.display = 'none'; });
  scene.front.addEventListener('contextmenu', (event) => event.preventDefault());
  scene.front.addEventListener('wheel', (event) => {
    event.preventDefault();
    const [x, y] = local(event);
    cameraAt(x, y).zoom(Math.exp(-event.deltaY * 0.0015), x, y);
    scene.refresh();
    redraw();
  }, { passive: false });

  // The line of the path under the pointer.
  function hover(x, y) {
    const row = player.playing ? -1 : scene.nearestRow(x, y);
    hint.style.display = row < 0 ? 'none' : 'block';
    if (row < 0) return;
    const at = data.lineAt(data.rows.ticks[row]);
    const text = (data.lines[at - 1] ?? '').trim();
    hint.textContent = `line ${at}: ${text.length > 48 ? `${text.slice(0, 47)}…` : text}`;
    hint.style.left = `${Math.min(x + 14, scene.stage.clientWidth - hint.offsetWidth - 4)}px`;
    hint.style.top = `${Math.max(2, y - 28)}px`;
  }

  let dragging = false;
  const toCursor = (event) => go(curves.tickAt(event.clientX - curves.canvas.getBoundingClientRect().left));
  curves.canvas.addEventListener('pointerdown', (event) => { dragging = true; toCursor(event); });
  curves.canvas.addEventListener('pointermove', (event) => { if (dragging) toCursor(event); });
  window.addEventListener('pointerup', () => { dragging = false; });

  let finding = -1;
  function nextFinding() {
    if (data.findings.length === 0) return;
    finding = (finding + 1) % data.findings.length;
    if (data.findings[finding].line > 0) goToLine(data.findings[finding].line);
    byId('findings').children[finding].scrollIntoView({ block: 'nearest' });
  }
  byId('next-finding').addEventListener('click', nextFinding);
  const help = byId('help');
  byId('help-button').addEventListener('click', () => help.showModal());

  function turn(dx, dy) {
    for (const camera of scene.cameras) {
      if (camera.view.space) camera.look(camera.yaw + dx * 0.1, camera.pitch + dy * 0.1);
      else camera.pan(-dx * 24, dy * 24);
    }
    scene.refresh();
    redraw();
  }
  function zoom(factor) {
    for (const camera of scene.cameras) {
      const { x, y, width, height } = camera.rect;
      camera.zoom(factor, x + width / 2, y + height / 2);
    }
    scene.refresh();
    redraw();
  }
  const keys = {
    ' ': () => player.play(!player.playing),
    ArrowLeft: (event) => { player.play(false); if (event.shiftKey) player.byBlocks(-1); else player.byRows(-1); },
    ArrowRight: (event) => { player.play(false); if (event.shiftKey) player.byBlocks(1); else player.byRows(1); },
    Home: () => go(0),
    End: () => go(data.lastTick),
    f: nextFinding,
    x: looks.side, y: looks.front, z: looks.top,
    a: () => turn(-1, 0), d: () => turn(1, 0), w: () => turn(0, 1), s: () => turn(0, -1),
    '+': () => zoom(1.25), '=': () => zoom(1.25), '-': () => zoom(0.8), 0: looks.fit, p: looks['fit-path'],
    '?': () => help.showModal(),
  };
  document.addEventListener('keydown', (event) => {
    const { target } = event;
    if (help.open || event.ctrlKey || event.metaKey || event.altKey) return;
    // A control keeps the keys that it has a use for itself.
    const own = { INPUT: target.type === 'checkbox' ? ' ' : '', SELECT: 'any', BUTTON: ' ', A: '' }[target.tagName] ?? '';
    if (own === 'any' || (own !== '' && own.includes(event.key))) return;
    const name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const joint = Number(name) - 1;
    if (name !== '0' && jointButtons[joint]) jointButtons[joint].click();
    else if (keys[name]) keys[name](event);
    else return;
    event.preventDefault();
  });

  function fromAddress() {
    const [, what, value] = /^#(tick|line)=(\d+)$/.exec(window.location.hash) ?? [];
    if (what === 'tick') go(Number(value));
    else if (what === 'line') goToLine(Number(value));
  }
  window.addEventListener('hashchange', fromAddress);

  function resize() {
    scene.layOut();
    curves.refresh();
    listing.render();
    redraw();
  }
  new ResizeObserver(resize).observe(scene.stage);
  function recolour() {
    colours.read();
    scene.refresh();
    curves.refresh();
    redraw();
  }
  window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', recolour);
  window.addEventListener('beforeprint', resize);
  window.addEventListener('afterprint', resize);

  scene.layOut();
  player.set(0);
  // A program that was refused opens where it fails.
  const error = data.findings.find((f) => f.severity === 'error' && f.line > 0);
  if (error && !window.location.hash) goToLine(error.line);
  fromAddress();
  document.documentElement.dataset.ready = 'true';
})();
