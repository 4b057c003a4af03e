// The page in a browser, opened from a file as a person would. Run with: npm run build && npm test
import assert from 'node:assert/strict';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { openBrowser } from '../tools/browser.mjs';
import { sampleData, writePage } from './fixture/sample.mjs';

const folder = mkdtempSync(join(tmpdir(), 'tendril-page-'));
let browser;

before(async () => { browser = await openBrowser(); });
after(async () => {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
});

/** Opens a page made of `data`; `problems` collects console errors and every request but the page's own. */
async function open(data, hash = '') {
  const file = join(folder, `${Math.random().toString(36).slice(2)}.html`);
  writePage(data, file);
  const tab = await browser.newPage({ viewport: { width: 920, height: 520 } });
  tab.setDefaultTimeout(120000); // software rendering on a busy machine
  const problems = [];
  tab.on('console', (message) => { if (message.type() === 'error') problems.push(message.text()); });
  tab.on('pageerror', (error) => problems.push(error.message));
  tab.on('request', (request) => {
    const { protocol } = new URL(request.url());
    if (request.url().split('#')[0] !== pathToFileURL(file).href && protocol !== 'data:' && protocol !== 'blob:') problems.push(request.url());
  });
  await tab.goto(`${pathToFileURL(file)}${hash}`);
  await settled(tab);
  return { tab, problems };
}

const settled = (tab) => tab.waitForFunction(() => window.tendril?.ready);
const tendril = (tab, what) => tab.evaluate(`window.tendril.${what}`);
const text = (tab, id) => tab.textContent(`#${id}`);

async function picture(tab) {
  await settled(tab);
  return tab.screenshot();
}

/** How much of a screenshot differs from another, or from its own corner if there is no other: fraction of the pixels. */
async function difference(tab, a, b) {
  return tab.evaluate(async ([first, second]) => {
    const pixels = async (base64) => {
      const image = new Image();
      image.src = `data:image/png;base64,${base64}`;
      await image.decode();
      const canvas = document.createElement('canvas');
      canvas.width = image.width;
      canvas.height = image.height;
      const context = canvas.getContext('2d');
      context.drawImage(image, 0, 0);
      return context.getImageData(0, 0, image.width, image.height).data;
    };
    const one = await pixels(first);
    const two = second ? await pixels(second) : null;
    let count = 0;
    for (let i = 0; i < one.length; i += 4) {
      let most = 0;
      for (let k = 0; k < 3; ++k) most = Math.max(most, Math.abs(one[i + k] - (two ? two[i + k] : one[k])));
      if (most > 40) ++count;
    }
    return count / (one.length / 4);
  }, [a.toString('base64'), b?.toString('base64')]);
}

test('opens from a file without errors or requests and draws the scene', async () => {
  const { tab, problems } = await open(sampleData(), '#still=1');
  assert.ok(await difference(tab, await picture(tab)) > 0.02, 'the picture is blank');
  assert.equal(await tab.isVisible('#summary'), false);
  assert.equal(await tab.title(), 'double-funnel – Tendril');
  assert.deepEqual(problems, []);
  await tab.close();
});

test('play advances the time at the chosen speed and space pauses', async () => {
  const { tab, problems } = await open(sampleData());
  assert.equal(await tendril(tab, 'time'), 0);
  await tab.keyboard.press('Space');
  await tab.waitForFunction(() => window.tendril.time > 0.2);
  assert.equal(await tendril(tab, 'playing'), true);
  assert.equal(await tab.getAttribute('#play', 'aria-label'), 'Pause (space)');
  await tab.keyboard.press('Space');
  const paused = await tendril(tab, 'time');
  await tab.waitForTimeout(200);
  assert.equal(await tendril(tab, 'time'), paused);
  assert.deepEqual(problems, []);
  await tab.close();
});

test('without loop playing ends at the end, with loop it goes on', async () => {
  const { tab } = await open(sampleData({ states: 5 }));
  await tab.click('#play');
  await tab.waitForTimeout(400);
  assert.equal(await tendril(tab, 'playing'), true);
  await tab.uncheck('#loop');
  await tab.waitForFunction(() => !window.tendril.playing);
  assert.equal(await tendril(tab, 'time'), await tendril(tab, 'duration'));
  await tab.close();
});

test('scrubbing moves the rod, and half-way between two states every node is half-way', async () => {
  const { tab } = await open(sampleData());
  const at = async (time) => {
    await tab.evaluate((value) => {
      const scrub = document.getElementById('scrub');
      scrub.value = value;
      scrub.dispatchEvent(new Event('input'));
    }, time);
    return tendril(tab, 'nodes()');
  };
  const [a, middle, b, far] = [await at(2.0), await at(2.0125), await at(2.025), await at(3.5)];
  middle.forEach((value, i) => assert.ok(Math.abs(value - (a[i] + b[i]) / 2) < 1e-6));
  assert.ok(Math.abs(far[0] - a[0]) > 0.3);
  await tab.close();
});

test('the drawn rod passes through its nodes with its true radius', async () => {
  const { Tube } = await import('../src/rod.js');
  const tube = new Tube(3, 0.25, null);
  tube.setShape([0, 0, 0, 2, 0, 0, 4, 0, 0], [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]);
  tube.geometry.computeBoundingBox();
  const { min, max } = tube.geometry.boundingBox;
  for (const [found, expected] of [[min.x, -0.25], [max.x, 4.25], [min.y, -0.25], [max.y, 0.25], [min.z, -0.25], [max.z, 0.25]])
    assert.ok(Math.abs(found - expected) < 1e-6);
});

test('the section plane changes the picture, and flipping it changes it again', async () => {
  const { tab, problems } = await open(sampleData(), '#t=0.5&opacity=1');
  const whole = await picture(tab);
  await tab.click('#section-controls label:has(input[value="x"])');
  const cut = await picture(tab);
  await tab.keyboard.press('\\');
  const flipped = await picture(tab);
  assert.ok(await difference(tab, whole, cut) > 0.01);
  assert.ok(await difference(tab, cut, flipped) > 0.01);
  assert.deepEqual(problems, []);
  await tab.close();
});

test('opacity and positions along the way change the picture', async () => {
  const { tab } = await open(sampleData(), '#t=0.5&opacity=1&still=1');
  const plain = await picture(tab);
  for (const [id, value] of [['opacity', 0.3], ['onion', 8]]) {
    await tab.evaluate(([name, to]) => {
      const input = document.getElementById(name);
      input.value = to;
      input.dispatchEvent(new Event('input'));
    }, [id, value]);
    assert.ok(await difference(tab, plain, await picture(tab)) > 0.003, id);
  }
  await tab.close();
});

test('says which ends are held and which one moves as time goes on', async () => {
  const { tab } = await open(sampleData());
  const told = [];
  for (const fraction of [0.2, 0.55, 0.9]) {
    await tendril(tab, `setTime(${fraction} * window.tendril.duration)`);
    told.push([await text(tab, 'now-held'), await text(tab, 'now-moving'), await tendril(tab, 'ends()')]);
  }
  assert.deepEqual(told, [
    ['last end', 'last end', ['free', 'moving']],
    ['both ends', 'last end', ['held', 'moving']],
    ['first end', 'first end', ['moving', 'free']],
  ]);
  await tab.close();
});

test('contacts are counted where the rod is in the tunnel and nowhere else', async () => {
  const { tab } = await open(sampleData());
  assert.equal(await tendril(tab, 'contacts()'), 0);
  assert.match(await text(tab, 'now-gap'), /over 4 mm/);
  await tendril(tab, 'setTime(0.5 * window.tendril.duration)');
  assert.ok(await tendril(tab, 'contacts()') > 0);
  await tab.close();
});

test('the keyboard steps through states, jumps to the ends, cuts, hides the panels and explains itself', async () => {
  const { tab, problems } = await open(sampleData());
  await tab.keyboard.press('ArrowRight');
  assert.match(await text(tab, 'now-state'), /^2 of 160$/);
  await tab.keyboard.press('Shift+ArrowRight');
  assert.match(await text(tab, 'now-state'), /^12 of/);
  await tab.keyboard.press('ArrowLeft');
  assert.match(await text(tab, 'now-state'), /^11 of/);
  await tab.keyboard.press('End');
  assert.match(await text(tab, 'now-state'), /^160 of/);
  await tab.keyboard.press('Home');
  assert.equal(await tendril(tab, 'time'), 0);
  await tab.keyboard.press('y');
  assert.equal(await tab.isChecked('input[name="axis"][value="y"]'), true);
  await tab.keyboard.press('h');
  assert.equal(await tab.isVisible('#transport'), false);
  await tab.keyboard.press('h');
  await tab.keyboard.press('?');
  assert.equal(await tab.isVisible('#help'), true);
  await tab.keyboard.press('Escape');
  assert.equal(await tab.isVisible('#help'), false);
  assert.deepEqual(problems, []);
  await tab.close();
});

test('says plainly when the problem was not solved', async () => {
  const { tab } = await open(sampleData({ status: 'time_limit' }));
  assert.equal(await text(tab, 'status'), 'Not solved');
  assert.match(await text(tab, 'status-note'), /time limit.*nearest to the goal/);
  await tab.close();
});

test('one state only, no obstacles, no goal, nothing at all: still a page', async () => {
  const empty = sampleData({ states: 1, meshes: false });
  empty.trajectory = { states: 0, nodes: 0, positions: '', rotations: '', time_s: '', held: '', gap_m: '' };
  empty.contacts = { stride: 1, reach_m: 0.01, offsets: 'AAAAAA==', points: '' };
  empty.goal = { shape: null, grippers: [] };
  for (const data of [sampleData({ states: 1 }), sampleData({ meshes: false }), sampleData({ states: 1, meshes: false }), empty]) {
    const { tab, problems } = await open(data, '#still=1&onion=3');
    assert.ok(await difference(tab, await picture(tab)) > 0.001, 'the picture is blank');
    await tab.keyboard.press('Space');
    assert.equal(await tendril(tab, 'playing'), data.trajectory.states > 1);
    assert.deepEqual(problems, []);
    await tab.close();
  }
});

test('a name is text, whatever it says', async () => {
  const name = '</script><script>window.broken = true</script><b>';
  const { tab, problems } = await open(sampleData({ name }));
  assert.equal(await text(tab, 'name'), name);
  assert.equal(await tab.evaluate('window.broken'), undefined);
  assert.deepEqual(problems, []);
  await tab.close();
});

test('every control has a name, and the picture follows the size of the window', async () => {
  const { tab } = await open(sampleData());
  const nameless = await tab.evaluate(() => [...document.querySelectorAll('button, input, select')]
    .filter((item) => !(item.ariaLabel || item.textContent.trim() || item.closest('label')?.textContent.trim())).map((item) => item.id));
  assert.deepEqual(nameless, []);
  await tab.setViewportSize({ width: 620, height: 480 });
  await tab.waitForFunction(() => document.getElementById('canvas').width === 620);
  await settled(tab);
  assert.ok(await difference(tab, await picture(tab)) > 0.02);
  await tab.close();
});
