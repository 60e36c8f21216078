// Curves over time: lowest and highest value of every stretch of time, so that no extreme is lost. One time cursor.
pkm.curves = (() => {
  const { data, colours } = pkm;
  const canvas = document.getElementById('plot');
  const table = document.querySelector('#readout tbody');
  const n = data.joints.length;
  const shown = data.joints.map(() => true);
  const { width: stretch, channels } = data.curves;
  const count = data.bounds.length / (2 * channels);
  const low = (i, c) => data.bounds[2 * (i * channels + c)];
  const high = (i, c) => data.bounds[2 * (i * channels + c) + 1];
  const LEFT = 58;
  const RIGHT = 12;
  let layer = null;
  let tick = 0;

  const maximum = (c) => {
    let most = 0;
    for (let i = 0; i < count; i += 1) if (high(i, c) > most) most = high(i, c);
    return most;
  };
  const measure = Math.min(1, Math.max(1e-3, maximum(3 * n + 1)));
  const deviation = Math.max(1e-6, maximum(3 * n + 2));

  // Strips from top to bottom: title, range, limit lines, and which channel each joint has in it.
  const strips = [
    { title: 'place in travel', unit: '%', from: 0, to: 1, limits: [0, 1], channel: (j) => 3 * j, scale: 100 },
    { title: 'velocity / limit', unit: '%', from: -1.08, to: 1.08, limits: [-1, 1], zero: true, channel: (j) => 3 * j + 1, scale: 100 },
    { title: 'acceleration / limit', unit: '%', from: -1.08, to: 1.08, limits: [-1, 1], zero: true, channel: (j) => 3 * j + 2, scale: 100 },
    { title: 'feed got / asked', unit: '%', from: 0, to: 1.08, limits: [1], one: 3 * n, colour: 'feed', scale: 100, low: true },
    { title: 'from singularity', unit: '', from: 0, to: measure * 1.08, limits: [0], one: 3 * n + 1, colour: 'corner', scale: 1, low: true },
    { title: 'deviation', unit: ' µm', from: 0, to: deviation * 1.08, limits: [], one: 3 * n + 2, colour: 'programmed', scale: 1000, low: true },
  ];

  function place() {
    const height = canvas.clientHeight - 22;
    const weights = strips.map((strip) => (strip.low ? 0.55 : 1));
    const total = weights.reduce((a, b) => a + b);
    let y = 4;
    strips.forEach((strip, i) => {
      strip.y = y;
      strip.height = (height * weights[i]) / total - 8;
      y += (height * weights[i]) / total;
    });
  }

  const x = (at) => LEFT + ((canvas.clientWidth - LEFT - RIGHT) * at) / Math.max(1, data.lastTick);
  const tickAt = (px) => Math.max(0, Math.min(data.lastTick,
    ((px - LEFT) / Math.max(1, canvas.clientWidth - LEFT - RIGHT)) * data.lastTick));

  function band(context, strip, channel, colour) {
    const y = (v) => strip.y + strip.height * (1 - (v - strip.from) / (strip.to - strip.from));
    context.beginPath();
    context.strokeStyle = colour;
    context.lineWidth = 1.3;
    let pen = false;
    for (let i = 0; i < count; i += 1) {
      const [a, b] = [low(i, channel), high(i, channel)];
      if (Number.isNaN(a)) { pen = false; continue; }
      const px = x(Math.min(data.lastTick, (i + 0.5) * stretch - 0.5));
      if (pen) context.lineTo(px, y(b)); else context.moveTo(px, y(b));
      if (b - a > 1e-9) {
        context.lineTo(px, y(a));
        context.moveTo(px, y(a));
      }
      pen = true;
    }
    context.stroke();
  }

  function number(value, unit) {
    const digits = Math.abs(value) >= 10 || value === 0 ? 0 : 2;
    return value.toFixed(digits).replace('-', '−') + unit;
  }

  function axes(context) {
    context.font = '11px system-ui, sans-serif';
    const duration = data.seconds(data.lastTick);
    for (const strip of strips) {
      context.fillStyle = colours.panel;
      context.fillRect(LEFT, strip.y, canvas.clientWidth - LEFT - RIGHT, strip.height);
      const y = (v) => strip.y + strip.height * (1 - (v - strip.from) / (strip.to - strip.from));
      context.textAlign = 'right';
      context.fillStyle = colours.soft;
      const top = strip.limits.length > 0 && strip.to < 1.2 && strip.limits.includes(1) ? 1 : strip.to / 1.08;
      context.fillText(number(top * strip.scale, strip.unit), LEFT - 4, y(top) + (strip.low ? 8 : 4));
      if (strip.zero) {
        context.fillText(number(-100, '%'), LEFT - 4, y(-1) + 4);
        context.fillText('0', LEFT - 4, y(0) + 4);
      } else context.fillText('0', LEFT - 4, y(0) + 2);
      context.lineWidth = 1;
      for (const limit of [...strip.limits, ...(strip.zero ? [0] : [])]) {
        context.strokeStyle = limit === 0 && strip.zero ? colours.line : colours.ink;
        context.beginPath();
        context.moveTo(LEFT, Math.round(y(limit)) + 0.5);
        context.lineTo(canvas.clientWidth - RIGHT, Math.round(y(limit)) + 0.5);
        context.stroke();
      }
    }
    const step = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 3600, 7200]
      .find((s) => (s / Math.max(duration, 1e-9)) * (canvas.clientWidth - LEFT - RIGHT) >= 56) ?? 36000;
    context.fillStyle = colours.soft;
    context.textAlign = 'center';
    for (let t = 0; t <= duration * 1.0001; t += step) {
      context.fillText(`${Number(t.toFixed(2))} s`, x(t / data.period_s), canvas.clientHeight - 6);
    }
  }

  // The curves change only with size, colours and the joints shown; the cursor is drawn over a copy.
  function drawLayer() {
    const ratio = Math.min(3, window.devicePixelRatio || 1);
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(canvas.clientHeight * ratio);
    layer = document.createElement('canvas');
    layer.width = canvas.width;
    layer.height = canvas.height;
    const context = layer.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    place();
    axes(context);
    for (const strip of strips) {
      context.save();
      context.beginPath();
      context.rect(LEFT, strip.y - 1, canvas.clientWidth - LEFT - RIGHT, strip.height + 2);
      context.clip();
      if (strip.channel) {
        for (let j = 0; j < n; j += 1) if (shown[j]) band(context, strip, strip.channel(j), colours['j' + j]);
      } else band(context, strip, strip.one, colours[strip.colour]);
      context.restore();
      context.font = '600 11px system-ui, sans-serif';
      context.textAlign = 'left';
      const words = context.measureText(strip.title).width;
      context.globalAlpha = 0.8;
      context.fillStyle = colours.panel;
      context.fillRect(LEFT + 4, strip.y + 1, words + 6, 15);
      context.globalAlpha = 1;
      context.fillStyle = colours.ink;
      context.fillText(strip.title, LEFT + 7, strip.y + 12);
    }
  }

  function draw(now) {
    tick = now;
    if (!data.timed) return;
    if (!layer) drawLayer();
    const context = canvas.getContext('2d');
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.drawImage(layer, 0, 0);
    const ratio = canvas.width / Math.max(1, canvas.clientWidth);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.strokeStyle = colours.tip;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x(tick), 0);
    context.lineTo(x(tick), canvas.clientHeight - 18);
    context.stroke();
  }

  // The table of numbers at the cursor.
  const cells = data.joints.map((joint, j) => {
    const row = document.createElement('tr');
    const name = document.createElement('th');
    name.scope = 'row';
    name.textContent = joint.name;
    name.style.color = `var(--j${j})`;
    const values = [0, 1, 2].map(() => document.createElement('td'));
    row.append(name, ...values);
    table.append(row);
    return values;
  });

  function readout(now) {
    const { row, share } = data.at(now);
    const positions = data.values('joints', now);
    const shares = data.values('shares', now);
    const pose = data.values('pose', now);
    const minus = (text) => text.replaceAll('-', '−');
    data.joints.forEach((joint, j) => {
      const percent = (v) => `${Math.round(100 * v)} %`;
      const [v, a] = [shares[2 * j], shares[2 * j + 1]];
      cells[j][0].textContent = minus(`${positions[j].toFixed(4)} ${joint.unit}`);
      cells[j][1].textContent = data.timed ? minus(`${(v * joint.velocity).toFixed(3)} ${joint.unit}/s, ${percent(v)}`) : '';
      cells[j][2].textContent = data.timed ? minus(`${(a * joint.acceleration).toFixed(1)} ${joint.unit}/s², ${percent(a)}`) : '';
    });
    const words = data.axes.map((axis, i) => `${axis.name}${minus(pose[i].toFixed(4))}`).join(' ');
    const [feed, singularity, off] = [0, 1, 2].map((i) => shares[2 * n + i]);
    const more = !data.timed ? '' : ` · ${pkm.limits.words(data.rows.limit[row])} · feed ${Math.round(100 * feed)} %`
      + (Number.isNaN(singularity) ? '' : ` · singularity ${singularity.toFixed(3)}`)
      + (Number.isNaN(off) ? '' : ` · deviation ${off.toFixed(5)} mm`);
    document.getElementById('readout-caption').textContent = `${share === 0 ? '' : '≈ '}${words}${more}`;
  }

  return { canvas, shown, draw, readout, tickAt, refresh() { layer = null; } };
})();
