// The browser test of report.html; started by judge-report.
import { chromium } from 'playwright-core';
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

const [pkm, work, root, artefacts, only] = process.argv.slice(2);
const WIDE = { width: 1280, height: 900 };
const PHONE = { width: 390, height: 844 };

// A small program for every machine, in steps from its home.
const frame = (size, feed = 900) => `G1 X${size} Y${size / 2} F${feed}\nG2 X0 Y${-size} I${-size / 4} J${-size / 2}\n`
  + `G1 X${-1.5 * size}\nG1 Y${size}\nG3 X${size / 2} Y${-size / 2} I${size / 2} J0\n`;
const around = (letters, by) => {
  const words = (sign) => [...letters].map((letter) => `${letter}${sign * by}`).join(' ');
  return letters ? `G1 ${words(1)}\nG1 ${words(-2)}\nG1 ${words(1)}\n` : '';
};
const relative = (text) => `%\n(a small program in steps from home)\nG21 G91 G94 G17 G64 P0.01\n${text}M2\n%\n`;
const shipped = (name) => readFileSync(join(root, 'programs', name), 'utf8');
const PROGRAMS = {
  'moma-a': shipped('moma-arcs.ngc'), 'moma-w': shipped('moma-w-aerofoil.ngc'),
  'hv-mill-7': shipped('hv-mill-both.ngc'), 'ox-glide-o': shipped('ox-glide-forms.ngc'),
  'moma-b': relative(frame(24)), 'moma-c': relative(frame(6)), 'moma-d': relative(frame(24)),
  'moma-4s-p': relative(frame(24)), 'moma-4s-s5': relative(frame(24)), 'moma-4s-s10': relative(frame(20)),
  'moma-4s-u5': relative(frame(24)), 'moma-4s-u10': relative(frame(24)),
  'hv-mill-h3': relative(frame(24) + around('Z', 8)), 'hv-mill-h4': relative(frame(24) + around('B', 20) + around('Z', 8)),
  'hv-mill-v3': relative(frame(24) + around('Z', 8)), 'hv-mill-v4': relative(frame(24) + around('C', 20) + around('Z', 8)),
  'hv-mill-v5': relative(frame(24) + around('C', 20) + around('B', 10)), 'hv-mill-6': relative(frame(24) + around('B', 15)),
  'ox-glide-x': relative(frame(4) + around('Z', 30)),
  lambda6: relative(frame(120, 3000) + around('ABC', 5) + around('Z', 60)),
  'lambda6-paper': relative(frame(60, 3000) + around('AB', 4) + around('Z', 60)),
  // families, with the configuration their files begin with
  moma: relative(frame(24)), 'moma-4s': relative(frame(24)), 'ox-glide': relative(frame(4) + around('Z', 30)),
  'hv-mill': shipped('hv-mill-both.ngc'),
  xyz: relative(frame(80) + around('Z', 40)), xyzabc: relative(frame(80) + around('ABC', 30)),
};

let failures = 0;
function check(holds, what) {
  if (holds) return;
  failures += 1;
  console.log(`FAIL ${what}`);
}

// pkm run; its exit status.
function run(name, machine, text, ...flags) {
  const program = join(work, `${name}.ngc`);
  const out = join(work, name);
  writeFileSync(program, text);
  try {
    execFileSync(pkm, ['run', program, '--machine', machine, '--out', out, ...flags], { timeout: 300000, stdio: 'pipe' });
    return { out, status: 0 };
  } catch (error) {
    return { out, status: error.status, said: String(error.stderr ?? error) };
  }
}

// trace.csv by ticks: line, and the pose in the order of the machine's axes.
function readTrace(file) {
  const [head, ...rows] = readFileSync(file, 'utf8').trimEnd().split('\n');
  const names = head.split(',');
  const poses = names.map((name, i) => (name.startsWith('axis.') ? i : -1)).filter((i) => i >= 0);
  return rows.map((row) => {
    const cells = row.split(',').map(Number);
    return { line: cells[2], pose: poses.map((i) => cells[i]) };
  });
}

const browser = await chromium.launch({
  executablePath: ['/usr/bin/chromium', '/usr/bin/chromium-browser'].find(existsSync),
  args: ['--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking',
    '--disable-component-update', '--disable-sync'],
  timeout: 60000,
});

// A page that notes every error, every request and every dialog.
async function open(out, options, name) {
  const context = await browser.newContext(options);
  const page = await context.newPage();
  page.machine = name.split(' ')[0];
  page.setDefaultTimeout(30000);
  page.on('console', (message) => check(message.type() !== 'error', `${name}: console: ${message.text()}`));
  page.on('pageerror', (error) => check(false, `${name}: ${error.stack}`));
  page.on('dialog', (dialog) => { check(false, `${name}: a dialog: ${dialog.message()}`); dialog.dismiss(); });
  page.on('request', (request) => check(request.url().startsWith('file:'), `${name}: asked for ${request.url()}`));
  const begun = Date.now();
  await page.goto(`file://${out}/report.html`);
  await page.waitForFunction(() => document.documentElement.dataset.ready === 'true');
  await page.evaluate(() => new Promise((painted) => requestAnimationFrame(() => setTimeout(painted))));
  return { page, context, ms: Date.now() - begun };
}

const tick = (page) => page.evaluate(() => pkm.player.tick);

// The tips on the screen against the trace: middle of the pixels in the tip's colour, and where the trace's pose belongs.
// Returns the largest distance in CSS pixels and how many were seen.
async function compare(page, trace, at) {
  const active = activePath(page.machine, trace, at);
  return page.evaluate(({ at, pose, active }) => {
    pkm.player.set(at);
    const canvas = pkm.scene.front;
    const ratio = canvas.width / canvas.clientWidth;
    const image = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    const tip = document.createElement('canvas').getContext('2d');
    tip.fillStyle = pkm.colours.tip;
    tip.fillRect(0, 0, 1, 1);
    const [r, g, b] = tip.getImageData(0, 0, 1, 1).data;
    const paths = pkm.scene.projected(pose);
    const places = paths.flat();
    let [worst, seen] = [0, 0];
    places.forEach(([x, y], n) => {
      if (active >= 0 && !paths[active].includes(places[n])) return;
      const alone = places.every(([u, v], m) => m === n || Math.hypot(u - x, v - y) > 26);
      const reach = 7; // the disc, without the ring around it
      const inside = x > reach && y > reach && x < canvas.clientWidth - reach && y < canvas.clientHeight - reach;
      if (!alone || !inside) return;
      let [sx, sy, count] = [0, 0, 0];
      for (let py = Math.floor((y - reach) * ratio); py <= (y + reach) * ratio; py += 1) {
        for (let px = Math.floor((x - reach) * ratio); px <= (x + reach) * ratio; px += 1) {
          const i = 4 * (py * canvas.width + px);
          if (image.data[i] === r && image.data[i + 1] === g && image.data[i + 2] === b && image.data[i + 3] === 255) {
            sx += px + 0.5;
            sy += py + 0.5;
            count += 1;
          }
        }
      }
      const distance = count < 20 ? Infinity : Math.hypot(sx / count / ratio - x, sy / count / ratio - y);
      worst = Math.max(worst, distance);
      seen += 1;
    });
    return { worst, seen };
  }, { at, pose: trace[at].pose, active });
}

// Of the two mechanisms of an HV-Mill only one follows the program; the coordinates of the other keep their values. It is the
// one whose own coordinates changed last: X Y Z (places 0 to 2) or U V W (5 to 7 after B and C). −1: all paths count.
function activePath(machine, trace, at) {
  if (!/^hv-mill(-[67])?$/.test(machine)) return -1;
  const same = (a, b, from) => [0, 1, 2].every((i) => a.pose[from + i] === b.pose[from + i]);
  for (let i = at; i > 0; i -= 1) {
    if (!same(trace[i], trace[i - 1], 0)) return 0;
    if (!same(trace[i], trace[i - 1], 5)) return 1;
  }
  return 0;
}

// The largest change of length of any link that the page draws, mm, over so many times between the kept rows.
const stretch = (page) => page.evaluate(() => {
  const { drawing } = pkm.data;
  const links = drawing.parts.filter((part) => part.kind === 'link' && part.points.length === 2);
  const point = (list, n) => (n < 0 ? drawing.fixed[-1 - n] : [0, 1, 2].map((i) => list[3 * n + i]));
  const lengths = (t) => {
    const list = pkm.data.values('points', t);
    return links.map(({ points: [a, b] }) => Math.hypot(...point(list, a).map((v, i) => v - point(list, b)[i])));
  };
  const first = lengths(0);
  let worst = 0;
  for (let k = 1; k <= 997; k += 1) {
    lengths((pkm.data.lastTick * k) / 997).forEach((length, i) => { worst = Math.max(worst, Math.abs(length - first[i])); });
  }
  return worst;
});

async function use(page, trace, name) {
  const last = trace.length - 1;
  check((await page.evaluate(() => pkm.data.lastTick)) === last, `${name}: the report does not end where the trace does`);
  // Play and pause, by pointer and by key.
  await page.click('#play');
  await page.waitForFunction(() => pkm.player.tick > 20 && pkm.player.playing);
  await page.keyboard.press('Space');
  await page.waitForFunction(() => !pkm.player.playing);
  check((await tick(page)) > 20, `${name}: does not play`);

  // A click on a line goes to its first row, and marks it.
  const lines = [...new Set(trace.slice(1, last).map((row) => row.line))].filter((line) => line > 0);
  const line = lines[Math.floor(lines.length / 2)];
  await page.evaluate((to) => pkm.listing.choose(to), line);
  await page.click(`#line-${line}`);
  const there = Math.round(await tick(page));
  check(trace[there].line === line, `${name}: a click on line ${line} goes to tick ${there}, line ${trace[there].line}`);
  check((await page.textContent('.row.now b')) === String(line), `${name}: line ${line} is not marked`);

  // Keys.
  await page.keyboard.press('End');
  check((await tick(page)) === last, `${name}: End`);
  await page.keyboard.press('Home');
  check((await tick(page)) === 0, `${name}: Home`);
  await page.evaluate(() => document.activeElement?.blur());
  await page.keyboard.press('ArrowRight');
  const one = await tick(page);
  check(one > 0, `${name}: →`);
  await page.keyboard.press('Shift+ArrowRight');
  check((await tick(page)) > one, `${name}: ⇧→`);
  await page.keyboard.press('1');
  check((await page.getAttribute('#joint-buttons button', 'aria-pressed')) === 'false', `${name}: key 1`);
  await page.keyboard.press('1');
  await page.keyboard.press('?');
  check(await page.evaluate(() => document.getElementById('help').open), `${name}: ?`);
  await page.keyboard.press('Escape');
  await page.keyboard.press('f');

  // The curves: a click in the middle is the middle of the time.
  const plot = page.locator('#plot');
  await plot.scrollIntoViewIfNeeded();
  const box = await plot.boundingBox();
  await page.mouse.click(box.x + 58 + (box.width - 70) / 2, box.y + 40);
  const middle = await tick(page);
  check(Math.abs(middle - last / 2) < last * 0.05 + 50, `${name}: a click in the middle of the curves goes to ${middle} of ${last}`);
  await page.evaluate(() => window.scrollTo(0, 0));

  // The numbers at a kept row are the trace's own; between two of them they are within what the report says.
  await page.keyboard.press('ArrowRight');
  const shown = await page.evaluate(({ last }) => {
    const at = (t) => ({ at: t, pose: [...pkm.data.values('pose', t)] });
    const between = Array.from({ length: 500 }, (_, k) => at(Math.round((last * k) / 499)));
    return { here: at(pkm.player.tick), between, error: pkm.data.error };
  }, { last });
  const off = ({ at, pose }) => Math.max(...pose.map((value, i) => Math.abs(value - trace[at].pose[i])));
  check(off(shown.here) <= 1e-9, `${name}: at tick ${shown.here.at} the report says ${shown.here.pose}, the trace ${trace[shown.here.at].pose}`);
  const worst = Math.max(...shown.between.map(off));
  check(worst <= shown.error + 1e-6, `${name}: ${worst} mm off between two rows, the report says ${shown.error}`);

  // Nothing without a name, nothing wider than the page.
  const nameless = await page.evaluate(() => [...document.querySelectorAll('button, select, input')]
    .filter((e) => !(e.textContent.trim() || e.getAttribute('aria-label') || e.labels?.[0]?.textContent.trim())).map((e) => e.id));
  check(nameless.length === 0, `${name}: controls without a name: ${nameless}`);
}

async function pixels(page, trace, name) {
  const last = trace.length - 1;
  const times = [0, 0.13, 0.29, 0.41, 0.5, 0.617, 0.77, 0.93, 1].map((share) => Math.round(share * last));
  let [worst, seen] = [0, 0];
  for (const at of times) {
    const got = await compare(page, trace, at);
    check(got.worst <= 1, `${name}: at tick ${at} the tool is drawn ${got.worst.toFixed(2)} pixels from where the trace has it`);
    worst = Math.max(worst, got.worst);
    seen += got.seen;
  }
  // On a small screen the two tools of an HV-Mill may hide each other.
  check(seen >= (page.machine.startsWith('hv-mill') ? 1 : times.length / 2), `${name}: the tool was seen only ${seen} times`);
  return { worst, seen };
}

async function fits(page, name) {
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
  check(wide <= 0, `${name}: ${wide} pixels wider than the screen`);
}

const machines = JSON.parse(execFileSync(pkm, ['machines', '--format', 'json'], { timeout: 30000 }).toString()).machines
  .map((machine) => machine.name);
for (const name of machines) {
  if (only && name !== only) continue;
  check(PROGRAMS[name], `${name}: no program in judge-report.mjs`);
  const { out, status, said } = run(name, name, PROGRAMS[name] ?? relative(''));
  check(status === 0, `${name}: pkm run ended with ${status}: ${said}`);
  if (status !== 0) continue;
  const trace = readTrace(join(out, 'trace.csv'));
  const wide = await open(out, { viewport: WIDE, colorScheme: 'light' }, name);
  await use(wide.page, trace, name);
  const { worst, seen } = await pixels(wide.page, trace, name);
  const longer = await stretch(wide.page);
  check(longer < 0.05, `${name}: a link changes its length by ${longer} mm`);
  await fits(wide.page, name);
  await wide.page.evaluate(() => pkm.player.set(pkm.data.lastTick * 0.35));
  await wide.page.screenshot({ path: join(artefacts, `${name}.png`) });
  await wide.context.close();
  const phone = await open(out, { viewport: PHONE, colorScheme: 'dark', hasTouch: true, isMobile: true, deviceScaleFactor: 2 }, `${name} (phone)`);
  const small = await pixels(phone.page, trace, `${name} (phone)`);
  await fits(phone.page, `${name} (phone)`);
  await phone.page.tap('#play');
  await phone.page.waitForFunction(() => pkm.player.tick > 20);
  await phone.page.tap('#play');
  await phone.page.evaluate(() => pkm.player.set(pkm.data.lastTick * 0.35));
  await phone.page.screenshot({ path: join(artefacts, `${name}-phone-dark.png`) });
  await phone.context.close();
  const kb = Math.round(statSync(join(out, 'report.html')).size / 1024);
  console.log(`${name}: ${kb} kB, open in ${wide.ms} ms; tool at most ${Math.max(worst, small.worst).toFixed(2)} pixels off `
    + `in ${seen + small.seen} looks; links true to ${longer.toFixed(4)} mm`);
  // Disks are small: only what is needed stays.
  for (const file of ['steps.vcd', 'trace.csv']) rmSync(join(out, file));
}

// The test itself can fail: the machine drawn 4 mm off must be noticed.
if (!only) {
  const { out } = run('sabotaged', 'moma-b', PROGRAMS['moma-b']);
  const trace = readTrace(join(out, 'trace.csv'));
  const { page, context } = await open(out, { viewport: WIDE }, 'sabotaged');
  await page.evaluate(() => { for (let i = 0; i < pkm.data.rows.points.length; i += 1) pkm.data.rows.points[i] += 4; });
  const { worst } = await compare(page, trace, 100);
  check(worst > 1, 'a machine drawn 4 mm off was not noticed');
  await context.close();
}

// A program that tries to become markup, has no UTF-8 and cannot run: the report opens where it fails.
if (!only) {
  const nasty = Buffer.concat([
    Buffer.from('G21 G90 F900 (</script><script>document.title="taken"</script>"\'&amp;<!--)\n(\u2028 bytes: '),
    Buffer.from([0xff, 0xfe, 0x00]), Buffer.from(')\nG1 X20 Y-250\nG1 X160 Y-200\nM2\n')]);
  const { out, status } = run('</title><script>alert(1)</script>'.replaceAll('/', '_'), 'moma-a', nasty);
  check(status === 1, `nasty: pkm run ended with ${status}`);
  const { page, context } = await open(out.replaceAll('<', '%3C').replaceAll('>', '%3E'), { viewport: WIDE, colorScheme: 'dark' }, 'nasty');
  check(!(await page.title()).startsWith('taken'), 'nasty: a comment became a script');
  check((await page.locator('script').count()) === 3, 'nasty: more scripts than ours');
  check((await page.textContent('#line-1')).includes('</script><script>'), 'nasty: line 1 is not shown as it is');
  check((await page.textContent('#verdict')).includes('refused'), 'nasty: no verdict');
  check((await page.textContent('.row.chosen b')) === '4', 'nasty: does not open where it fails');
  const past = await page.evaluate(() => pkm.data.values('joints', pkm.player.tick)[0] - pkm.data.joints[0].range[1]);
  check(past > 1, `nasty: joint p1 is drawn ${past} mm past its end`);
  await page.screenshot({ path: join(artefacts, 'refused.png') });
  await context.close();
  const still = run('no-motion', 'moma-a', 'G21 (nothing moves)\nM2\n');
  const { page: quiet, context: closing } = await open(still.out, { viewport: WIDE }, 'no-motion');
  await quiet.keyboard.press('Space');
  await quiet.keyboard.press('ArrowRight');
  await quiet.keyboard.press('f');
  await closing.close();
}

// 100,000 blocks: how long it takes to open, and how it plays.
if (!only || only === 'large') {
  let text = 'G21 G90 G94 G17 G64 P0.01 F3000\n';
  for (let i = 0; i < 100000; i += 1) {
    const [angle, radius] = [i * 0.01, 20 + 15 * Math.sin(i * 0.0007)];
    text += `G1 X${(radius * Math.cos(angle)).toFixed(4)} Y${(-265 + radius * Math.sin(angle)).toFixed(4)}\n`;
  }
  const { out, status, said } = run('large', 'moma-a', `${text}M2\n`, '--no-trace');
  check(status === 0, `large: ${said}`);
  rmSync(join(out, 'steps.vcd'));
  const times = [];
  for (let n = 0; n < 3; n += 1) {
    const { page, context, ms } = await open(out, { viewport: WIDE }, 'large');
    times.push(ms);
    if (n === 2) {
      await page.selectOption('#speed', '100');
      await page.evaluate(() => document.activeElement.blur());
      await page.keyboard.press('Space');
      const frames = await page.evaluate(() => new Promise((done) => {
        let n = 0;
        const begun = performance.now();
        const step = (now) => { n += 1; if (now - begun < 2000) requestAnimationFrame(step); else done((n / (now - begun)) * 1000); };
        requestAnimationFrame(step);
      }));
      await page.keyboard.press('Space');
      await page.evaluate(() => pkm.listing.choose(90000));
      await page.click('#line-90000');
      check((await page.evaluate(() => pkm.data.lineAt(pkm.player.tick))) >= 90000, 'large: a click on line 90,000');
      await page.screenshot({ path: join(artefacts, 'large.png') });
      console.log(`100,000 blocks: ${Math.round(statSync(join(out, 'report.html')).size / 1024)} kB, open in `
        + `${times.join(', ')} ms, ${frames.toFixed(0)} frames/s while playing`);
    }
    await context.close();
  }
}

await browser.close();
mkdirSync(artefacts, { recursive: true });
console.log(failures === 0 ? 'report.html: everything holds' : `report.html: ${failures} failures`);
process.exit(failures === 0 ? 0 : 1);
