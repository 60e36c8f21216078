// The program beside the scene. Only the lines on the screen are in the page, so a program may be long.
pkm.listing = (() => {
  const { data } = pkm;
  const box = document.getElementById('lines');
  const room = document.getElementById('room');
  const where = document.getElementById('where');
  const HEIGHT = 20;
  const MOST = 1500000; // a browser's elements are not taller than this many rows
  const count = Math.min(data.lines.length, MOST);
  const IDLE = /^\s*([(;%].*)?$/; // nothing, or a comment
  const findings = new Map();
  for (const finding of data.findings) {
    if (!findings.has(finding.line)) findings.set(finding.line, []);
    findings.get(finding.line).push(finding);
  }
  let current = 0;
  let chosen = 0;
  let from = -1;
  let go = () => {};

  room.style.height = `${count * HEIGHT}px`;
  const widest = data.lines.reduce((most, line) => Math.max(most, line.length), 0);
  room.style.minWidth = `max(100%, ${Math.min(widest, 1024) + 8}ch)`;

  // Control characters are shown as pictures of themselves.
  const visible = (text) => text.replace(/[\u0000-\u001f\u007f]/g, (c) =>
    (c === '\t' ? c : String.fromCharCode(c === '\u007f' ? 0x2421 : 0x2400 + c.charCodeAt(0))));

  // The text of a line, with what findings point at underlined.
  function fill(row, line, text) {
    const marks = (findings.get(line) ?? []).filter((f) => f.column > 0)
      .map((f) => [f.column - 1, Math.max(f.end_column - 1, f.column)]).sort((a, b) => a[0] - b[0]);
    let at = 0;
    for (const [start, end] of marks) {
      if (start < at || start >= text.length) continue;
      row.append(visible(text.slice(at, start)));
      const mark = document.createElement('u');
      mark.textContent = visible(text.slice(start, end));
      row.append(mark);
      at = end;
    }
    row.append(visible(text.slice(at)));
  }

  function element(line) {
    const row = document.createElement('div');
    row.className = 'row';
    row.id = `line-${line}`;
    row.setAttribute('role', 'option');
    row.style.top = `${(line - 1) * HEIGHT}px`;
    row.dataset.line = line;
    const number = document.createElement('b');
    number.textContent = line;
    row.append(number);
    fill(row, line, data.lines[line - 1]);
    if (IDLE.test(data.lines[line - 1])) row.classList.add('idle');
    const notes = findings.get(line);
    if (notes) {
      row.classList.add('has-finding');
      row.title = notes.map((f) => `${f.severity}: ${f.message}`).join('\n');
    }
    return row;
  }

  function mark() {
    for (const row of room.children) {
      const line = Number(row.dataset.line);
      row.classList.toggle('now', line === current);
      row.classList.toggle('chosen', line === chosen);
      row.setAttribute('aria-selected', line === current ? 'true' : 'false');
    }
  }

  function render() {
    const first = Math.max(1, Math.floor(box.scrollTop / HEIGHT) - 10);
    if (first === from) return mark();
    from = first;
    const last = Math.min(count, first + Math.ceil(box.clientHeight / HEIGHT) + 30);
    const rows = [];
    for (let line = first; line <= last; line += 1) rows.push(element(line));
    room.replaceChildren(...rows);
    mark();
  }

  function reveal(line) {
    const top = (line - 1) * HEIGHT;
    const margin = 2 * HEIGHT;
    if (top < box.scrollTop + margin || top > box.scrollTop + box.clientHeight - margin - HEIGHT) {
      box.scrollTop = top - box.clientHeight / 2;
    }
  }

  // The machine is at this line.
  function set(line) {
    if (line === current) return;
    current = line;
    if (line > 0 && line <= count) reveal(line);
    where.textContent = line > 0 ? `line ${line} of ${data.lines.length}` : `${data.lines.length} lines`;
    render();
  }

  // A line chosen by keys, not yet gone to.
  function choose(line) {
    chosen = Math.max(1, Math.min(count, line));
    reveal(chosen);
    from = -1;
    render();
    box.setAttribute('aria-activedescendant', `line-${chosen}`);
  }

  box.addEventListener('scroll', () => render(), { passive: true });
  box.addEventListener('click', (event) => {
    const row = event.target.closest('.row');
    if (row) go(Number(row.dataset.line));
  });
  box.addEventListener('keydown', (event) => {
    const page = Math.floor(box.clientHeight / HEIGHT) - 1;
    const by = { ArrowUp: -1, ArrowDown: 1, PageUp: -page, PageDown: page }[event.key];
    if (by) choose((chosen || current || 1) + by);
    else if (event.key === 'Enter') go(chosen || current);
    else return;
    event.preventDefault();
    event.stopPropagation();
  });

  const list = document.getElementById('findings');
  for (const finding of data.findings) {
    const item = document.createElement('li');
    const button = document.createElement('button');
    button.textContent = finding.line > 0 ? `line ${finding.line}` : 'whole program';
    button.addEventListener('click', () => go(finding.line));
    const kind = document.createElement('b');
    kind.textContent = ` ${finding.severity}: `;
    if (finding.severity === 'error') kind.className = 'error';
    const help = document.createElement('span');
    help.className = 'why';
    help.textContent = finding.help ? ` ${finding.help}` : '';
    item.append(button, kind, visible(finding.message), help);
    list.append(item);
  }
  document.getElementById('next-finding').disabled = data.findings.length === 0;

  return {
    set, choose, render: () => { from = -1; render(); },
    onGo: (f) => { go = f; },
  };
})();
