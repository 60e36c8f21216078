// The data of the run: typed arrays from base64, and what the machine is like at any time.
const pkm = {};

pkm.data = (() => {
  const raw = JSON.parse(document.getElementById('data').textContent);
  const lines = JSON.parse(document.getElementById('program-text').textContent);

  function bytes(base64) {
    const text = atob(base64);
    const all = new Uint8Array(text.length);
    for (let i = 0; i < all.length; i += 1) all[i] = text.charCodeAt(i);
    return all;
  }
  const f32 = (base64) => new Float32Array(bytes(base64).buffer);
  const f64 = (base64) => new Float64Array(bytes(base64).buffer);

  // Numbers of seven bits a byte; `shape` says for each in turn whether it has a sign. Every number is a difference to
  // the one in the same column before.
  function differences(base64, shape) {
    const all = bytes(base64);
    const out = [];
    const last = shape.map(() => 0);
    for (let i = 0, n = 0; i < all.length; n += 1) {
      let value = 0;
      let weight = 1;
      for (;;) {
        const byte = all[i];
        i += 1;
        value += (byte & 127) * weight;
        if (byte < 128) break;
        weight *= 128;
      }
      const column = n % shape.length;
      const signed = shape[column] && value % 2 === 1 ? -(value + 1) / 2 : shape[column] ? value / 2 : value;
      last[column] += signed;
      out.push(last[column]);
    }
    return out;
  }

  const axes = raw.axes.length;
  const joints = raw.joints.length;
  const ticks = Float64Array.from(differences(raw.rows.tick, [false]));
  const blocks = differences(raw.blocks, [true, false]);
  const rows = {
    count: raw.rows.count,
    ticks,
    limit: bytes(raw.rows.limit).map((code) => code & 127),
    jump: bytes(raw.rows.limit).map((code) => code >> 7),
    pose: f64(raw.rows.pose),
    joints: f64(raw.rows.joints),
    executed: f32(raw.rows.executed),
    shares: f32(raw.rows.shares),
    points: f32(raw.rows.points),
  };
  const width = { pose: axes, joints, executed: 2 * axes, shares: 2 * joints + 3, points: 3 * raw.drawing.moving };
  const blockLine = Int32Array.from(blocks.filter((_, i) => i % 2 === 0));
  const blockTick = Float64Array.from(blocks.filter((_, i) => i % 2 === 1));

  // The last place of `list` that is not above `value`; 0 if none is.
  function place(list, value) {
    let low = 0;
    let high = list.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (list[middle] <= value) low = middle; else high = middle - 1;
    }
    return low;
  }

  const lastTick = rows.count > 0 ? ticks[rows.count - 1] : 0;

  // The row at or before a time, and how far the time is on the way to the next one.
  function at(tick) {
    const row = place(ticks, tick);
    if (row + 1 >= rows.count) return { row, share: 0 };
    return { row, share: Math.min(1, Math.max(0, (tick - ticks[row]) / (ticks[row + 1] - ticks[row]))) };
  }

  // One of the arrays of `rows` at a time: the row's own numbers, or between two rows.
  function values(name, tick, out = new Float64Array(width[name])) {
    const { row, share } = at(tick);
    const stride = width[name];
    const list = rows[name];
    for (let i = 0; i < stride; i += 1) {
      const here = list[row * stride + i];
      out[i] = share === 0 ? here : here + share * (list[(row + 1) * stride + i] - here);
    }
    return out;
  }

  const blockAt = (tick) => (blockLine.length === 0 ? -1 : place(blockTick, tick));
  const firstBlock = new Map();
  for (let i = blockLine.length - 1; i >= 0; i -= 1) firstBlock.set(blockLine[i], i);

  // The kept row at or after the beginning of a block.
  function tickOfBlock(block) {
    return Math.min(lastTick, blockTick[block] + (raw.timed ? 1 : 0));
  }

  return {
    ...raw, lines, rows, width, lastTick, at, values, place,
    bounds: f32(raw.curves.bounds),
    corners: { count: raw.programmed.count, pose: f32(raw.programmed.pose), flags: bytes(raw.programmed.flags) },
    blockLine, blockTick, blockAt, tickOfBlock,
    blockOfLine: (line) => firstBlock.get(line) ?? -1,
    lineAt: (tick) => (blockLine.length === 0 ? 0 : blockLine[place(blockTick, Math.max(0, tick - (raw.timed ? 0.5 : 0)))]),
    seconds: (tick) => tick * raw.period_s,
  };
})();

// Colours of the style sheet, read again when light turns to dark.
pkm.colours = (() => {
  const names = ['paper', 'panel', 'ink', 'soft', 'line', 'finding', 'grid', 'space', 'space-edge', 'programmed', 'body', 'body-fill',
    'tip', 'wire', 'feed', 'corner', 'ahead', 'j0', 'j1', 'j2', 'j3', 'j4', 'j5', 'j6', 'j7', 'j8'];
  const all = {};
  all.read = () => {
    const style = getComputedStyle(document.documentElement);
    for (const name of names) all[name] = style.getPropertyValue('--' + name).trim();
  };
  all.read();
  return all;
})();

// What limits, by the code of a row: the legend's entries.
pkm.limits = (() => {
  const joint = (code) => (code - 4) >> 2;
  const kinds = [
    { name: 'feed', colour: 'feed', has: (code) => code === 0 },
    { name: 'corner', colour: 'corner', has: (code) => code === 1 || (code >= 4 && ((code - 4) & 2) !== 0) },
    { name: 'look-ahead, dwell', colour: 'ahead', has: (code) => code === 2 || code === 3 },
    ...pkm.data.joints.map((j, n) => ({
      name: j.name, colour: 'j' + n, has: (code) => code >= 4 && joint(code) === n && ((code - 4) & 2) === 0,
    })),
  ].map((kind) => ({ ...kind, shown: true }));
  const ofCode = (code) => kinds.findIndex((kind) => kind.has(code));
  function words(code) {
    if (code < 4) return ['feed', 'feed, on a corner', 'look-ahead', 'dwell'][code];
    const name = pkm.data.joints[joint(code)]?.name ?? '?';
    return name + ((code - 4) & 1 ? ' acceleration' : ' velocity') + ((code - 4) & 2 ? ', on a corner' : '');
  }
  return { kinds, ofCode, words };
})();
