// A still picture of a page, taken in headless Chromium:
//   node viewer/tools/picture.mjs page.html out.png [--time-fraction 0.5] [--overlay N] [--view 35,20[,zoom]] [--fit rod]
//     [--opacity 0.5] [--section x,0.5[,flip]] [--up z] [--size 1600x900] [--panel] [--hide ghosts,names,...]
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { openBrowser } from './browser.mjs';

const text = (value) => ({ type: 'string', ...(value && { default: value }) });
const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    'time-fraction': text('0.5'), overlay: text(), view: text(), fit: text(), opacity: text(), section: text(), up: text(),
    size: text('1600x900'), panel: { type: 'boolean', default: false }, hide: text(),
  },
});
if (positionals.length !== 2) {
  console.error('usage: node viewer/tools/picture.mjs page.html out.png [--time-fraction 0.5] [--overlay N] [...]');
  process.exit(2);
}
const [page, out] = positionals;
const [width, height] = values.size.split('x').map(Number);
const hash = new URLSearchParams({ t: values['time-fraction'], still: values.panel ? '0' : '1' });
for (const key of ['view', 'fit', 'opacity', 'section', 'up']) if (values[key]) hash.set(key, values[key]);
if (values.overlay) hash.set('onion', values.overlay);
for (const name of values.hide?.split(',') ?? []) hash.set(name, '0');

const browser = await openBrowser();
try {
  const tab = await browser.newPage({ viewport: { width, height } });
  tab.on('pageerror', (error) => {
    console.error(error.message);
    process.exitCode = 1;
  });
  await tab.goto(`${pathToFileURL(resolve(page))}#${hash}`);
  await tab.waitForFunction(() => window.tendril?.ready, null, { timeout: 60000 });
  await tab.screenshot({ path: out });
} finally {
  await browser.close();
}
