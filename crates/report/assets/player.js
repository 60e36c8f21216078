// Time: one number, the tick, that everything else shows.
pkm.player = (() => {
  const { data } = pkm;
  const slider = document.getElementById('time');
  const button = document.getElementById('play');
  const clock = document.getElementById('clock');
  const speed = document.getElementById('speed');
  const calm = window.matchMedia('(prefers-reduced-motion: reduce)');
  let tick = 0;
  let playing = false;
  let before = 0;
  let shown = () => {};

  slider.max = data.lastTick;
  if (!data.timed) {
    speed.disabled = true;
    clock.title = 'nothing moved: this is the programmed path, place by place';
  }

  function set(to) {
    tick = Math.max(0, Math.min(data.lastTick, to));
    slider.value = tick;
    const line = data.lineAt(tick);
    const words = data.timed
      ? `${data.seconds(tick).toFixed(3)} of ${data.seconds(data.lastTick).toFixed(2)} s`
      : `place ${Math.round(tick)} of ${data.lastTick}, not run`;
    clock.textContent = words;
    slider.setAttribute('aria-valuetext', `${words}, line ${line}`);
    shown(tick, line);
  }

  // To the nearest kept row, where every number is the trace's own, if it is not further than a pixel or two.
  function snap() {
    const { row, share } = data.at(tick);
    const nearest = data.rows.ticks[share > 0.5 ? row + 1 : row];
    if (!data.timed || Math.abs(nearest - tick) <= data.lastTick / 1000) set(nearest);
    else set(Math.round(tick));
  }

  function play(on) {
    if (on === playing) return;
    playing = on;
    button.textContent = on ? '❚❚ Pause' : '▶ Play';
    button.setAttribute('aria-pressed', on ? 'true' : 'false');
    if (!on) return;
    if (tick >= data.lastTick) set(0);
    before = performance.now();
    requestAnimationFrame(step);
  }

  function step(now) {
    if (!playing) return;
    const seconds = (now - before) / 1000;
    // Who asked for less motion sees two pictures a second.
    if (calm.matches && seconds < 0.5) {
      requestAnimationFrame(step);
      return;
    }
    before = now;
    const rate = data.timed ? Number(speed.value) / data.period_s : data.lastTick / 12;
    set(tick + seconds * rate);
    if (tick >= data.lastTick) play(false);
    else requestAnimationFrame(step);
  }

  function byRows(n) {
    const { row, share } = data.at(tick);
    const from = n < 0 && share > 0 ? row + 1 : row;
    set(data.rows.ticks[Math.max(0, Math.min(data.rows.count - 1, from + n))]);
  }

  function byBlocks(n) {
    const block = data.blockAt(Math.max(0, tick - (data.timed ? 0.5 : 0)));
    if (block < 0) return;
    set(data.tickOfBlock(Math.max(0, Math.min(data.blockLine.length - 1, block + n))));
  }

  // To the first execution of a line, or of the next line that was executed.
  function toLine(line) {
    let block = data.blockOfLine(line);
    if (block < 0) block = data.blockLine.findIndex((other) => other >= line);
    if (block < 0) block = data.blockLine.length - 1;
    if (block >= 0) set(data.tickOfBlock(block));
    // In a program that was refused: to the drawn place next to the one that the machine cannot be at.
    const bad = data.refused.find((place) => place.line === line);
    if (data.timed || !bad) return;
    const stride = data.width.pose;
    let best = { row: -1, distance: Infinity };
    for (let row = 0; row < data.rows.count; row += 1) {
      if (data.lineAt(row) > line) break;
      const off = bad.pose.map((v, i) => v - data.rows.pose[row * stride + i]);
      const distance = Math.hypot(...off);
      if (distance <= best.distance) best = { row, distance };
    }
    if (best.row >= 0) set(data.rows.ticks[best.row]);
  }

  slider.addEventListener('input', () => { play(false); set(Number(slider.value)); });
  slider.addEventListener('change', snap);
  button.addEventListener('click', () => play(!playing));
  document.getElementById('back-block').addEventListener('click', () => { play(false); byBlocks(-1); });
  document.getElementById('next-block').addEventListener('click', () => { play(false); byBlocks(1); });

  return {
    set, play, snap, byRows, byBlocks, toLine,
    get tick() { return tick; },
    get playing() { return playing; },
    onShown: (f) => { shown = f; },
  };
})();
